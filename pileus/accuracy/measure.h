#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lib/image/metrics.h"
#include "pileus/accuracy/method.h"
#include "pileus/accuracy/reference.h"
#include "pileus/pileus.h"

namespace pileus {

struct AccuracyOptions {
  int threads = 0;  ///< 0: all cores
  int repeat = 3;   ///< timed runs of each setting, after one that is not timed
  std::vector<double> tolerances{0.03, 0.01, 0.003, 0.001, 0.0003};
  std::vector<std::string> methods;  ///< names; none: all
  double run_limit = 20.0;           ///< [s] a run that takes longer is given up
  std::filesystem::path folder;      ///< keeps the reference; empty: it is not kept
  std::function<void(double)> progress;
  std::function<bool()> is_cancelled;  ///< true ends in Error(cancelled)
};

/// Of several timed runs [s].
struct Spread {
  double median = 0.0, min = 0.0, max = 0.0;
};

/// The spread of at least one number; the median of an even count is the mean of the middle two.
Spread spread_of(std::vector<double> values);

/// One setting, measured.
struct AccuracyRun {
  AccuracySetting setting;
  Spread total, render;  ///< of building and rendering, and of rendering alone [s]
  ImageDifference difference;
  double relative_rmse = 0.0;  ///< rmse / root mean square of the reference
  Counters counters;
  std::optional<OwnError> estimate, bound;  ///< where the integrator gives one
  bool is_resolved = true;                  ///< false: the reference is not exact enough to tell the error
  std::shared_ptr<const Image> picture;     ///< of a method's coarsest and finest run alone

  /// Density look-ups towards the camera and the lights.
  double lookups() const;
};

/// Everything that was measured on a scene.
struct AccuracyStudy {
  AccuracyReference reference;
  std::vector<AccuracyMethod> methods;
  std::vector<AccuracyRun> runs;   ///< method by method, each from coarse to fine
  std::vector<std::string> notes;  ///< what was left out, and why
  int threads = 0, repeat = 0;     ///< as measured
};

/// Far below the finest tolerance asked for.
double reference_tolerance(const std::vector<double>& tolerances);

/// Measures one setting against the reference. `progress` is called with the share done.
/// returns: none where it takes longer than options.run_limit
std::optional<AccuracyRun> measure_setting(const Scene& scene, const AccuracySetting& setting,
                                           const AccuracyReference& reference, const AccuracyOptions& options,
                                           const std::function<void(double)>& progress);

/// Measures all methods, each on a ladder from coarse to fine: those with a step over halvings around the
/// step that the scene suggests, the others over options.tolerances. A ladder ends where a run is expected to
/// take longer than options.run_limit.
AccuracyStudy measure_accuracy(const Scene& scene, const AccuracyOptions& options);

}  // namespace pileus
