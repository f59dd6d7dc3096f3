#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pileus/accuracy/measure.h"
#include "pileus/accuracy/power_law.h"
#include "pileus/accuracy/trade_off.h"

namespace pileus {

/// The columns of the equal-error table [radiance] and of the equal-time table [s].
inline constexpr std::array<double, 3> kErrorLevels{1e-2, 1e-3, 1e-4};
inline constexpr std::array<double, 3> kTimeLevels{0.1, 1.0, 10.0};

/// What the runs of one method say together. Runs whose error the reference cannot tell have no part in it.
struct MethodSummary {
  AccuracyMethod method;
  std::vector<size_t> runs;         ///< of the study, from coarse to fine
  std::optional<PowerLaw> order;    ///< rmse over the setting: the exponent is the order of convergence
  std::optional<PowerLaw> seconds;  ///< seconds over rmse
  std::optional<PowerLaw> lookups;  ///< look-ups over rmse
  std::array<ReadOff, kErrorLevels.size()> seconds_at_error;
  std::array<ReadOff, kTimeLevels.size()> error_after;
};

struct AccuracyAnalysis {
  std::vector<MethodSummary> methods;
  std::vector<bool> is_on_front;  ///< per run: no other is faster and more exact
  std::optional<size_t> best;     ///< the method that takes the least time at the middle error of the front
};

AccuracyAnalysis analyse(const AccuracyStudy& study);

/// Times the time that a tenth of the error costs.
double cost_of_a_digit(const PowerLaw& seconds_over_error);

/// The one sentence: "On this scene, ten times more accurate costs 2.4 times the time (march)." Where a
/// method is beyond what the reference can tell from its coarsest setting on, another says so.
std::string conclusion(const AccuracyStudy& study, const AccuracyAnalysis& analysis);

}  // namespace pileus
