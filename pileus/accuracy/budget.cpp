#include "pileus/accuracy/budget.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "integrators/default_step.h"
#include "lib/core/error.h"
#include "lib/scene/world.h"

namespace pileus {
namespace {

constexpr double kFactor = 4.0;      ///< between settings until the limit is bracketed
constexpr int kMostRungs = 8;        ///< of that
constexpr int kInterpolations = 2;   ///< after that
constexpr double kHopeless = 2.0;    ///< times the budget: a run is given up
constexpr double kNearlyAll = 0.93;  ///< of the budget: aimed at, as times vary

/// The search along one method's settings.
class MethodSearch {
 public:
  MethodSearch(const Scene& scene, double budget, const AccuracyReference& reference,
               const AccuracyOptions& options)
      : m_scene(scene), m_budget(budget), m_reference(reference), m_options(options) {
    m_options.run_limit = kHopeless * budget;
    m_options.progress = nullptr;
  }

  void search(AccuracySetting start, const std::function<void(double)>& progress) {
    AccuracySetting setting = std::move(start);
    const int repeat = std::exchange(m_options.repeat, 1);  // on the way to the limit once is enough
    const bool begins_within = measure(setting);
    for (int rung = 1; rung < kMostRungs; ++rung) {
      progress(double(rung) / (kMostRungs + kInterpolations));
      if (begins_within && !runs.back().is_resolved) return;  // finer, and nobody can tell
      setting.value() *= begins_within ? 1.0 / kFactor : kFactor;
      if (measure(setting) != begins_within) break;
    }
    m_options.repeat = repeat;
    for (int n = 0; n < kInterpolations && m_within && m_beyond; ++n) {
      setting.value() = interpolated();
      measure(setting);
    }
  }

  std::vector<AccuracyRun> runs;

 private:
  struct Sample {
    double value, seconds;
  };

  /// Measures a setting; returns whether it fits into the budget.
  bool measure(const AccuracySetting& setting) {
    auto run = measure_setting(m_scene, setting, m_reference, m_options, [](double) {});
    const Sample sample{setting.value(), run ? run->total.median : m_options.run_limit};
    const bool is_within = sample.seconds <= m_budget;
    if (is_within && (!m_within || sample.value < m_within->value)) m_within = sample;
    if (!is_within && (!m_beyond || sample.value > m_beyond->value)) m_beyond = sample;
    if (run) runs.push_back(std::move(*run));
    return is_within;
  }

  /// The setting expected to take nearly all of the budget, on the log-log line between the nearest two.
  double interpolated() const {
    const double span = std::log(m_beyond->seconds / m_within->seconds);
    const double share = span > 0.0 ? std::log(kNearlyAll * m_budget / m_within->seconds) / span : 0.5;
    return m_within->value * std::pow(m_beyond->value / m_within->value, std::clamp(share, 0.05, 0.95));
  }

  const Scene& m_scene;
  const double m_budget;
  const AccuracyReference& m_reference;
  AccuracyOptions m_options;
  std::optional<Sample> m_within, m_beyond;  ///< the finest that fits, the coarsest that does not
};

std::vector<AccuracyMethod> methods_to_try(const AccuracyOptions& options) {
  std::vector<AccuracyMethod> methods = chosen_methods(accuracy_methods(plugin_registry()), options.methods);
  if (options.methods.empty()) {
    std::erase_if(methods, [](const AccuracyMethod& method) { return !method.parameter.empty(); });
  }
  return methods;
}

const AccuracyRun& best_of(const std::vector<AccuracyRun>& runs, double budget) {
  const AccuracyRun *best = nullptr, *fastest = nullptr;
  for (const AccuracyRun& run : runs) {
    if (!fastest || run.total.median < fastest->total.median) fastest = &run;
    if (run.total.median > budget) continue;
    if (!best || run.difference.rmse < best->difference.rmse) best = &run;
  }
  if (best) return *best;
  throw Error(ErrorKind::failed, SourceLoc{},
              fmt::format("{:g} s are too short for a picture of this size{}", budget,
                          fastest ? fmt::format("; the fastest, {}, takes {:.3g} s",
                                                to_string(fastest->setting), fastest->total.median)
                                  : ""));
}

}  // namespace

BudgetAnswer best_within(const Scene& scene, double seconds, const AccuracyOptions& options) {
  const double step = default_step(build_world(scene));
  const std::vector<AccuracyMethod> methods = methods_to_try(options);
  const double parts = double(methods.size()) + 1.0;  // the reference is one
  const auto part = [&](size_t index) {
    return [&options, parts, index](double share) {
      if (options.progress) options.progress((double(index) + share) / parts);
    };
  };
  RenderOptions reference_options;
  reference_options.threads = options.threads;
  reference_options.is_cancelled = options.is_cancelled;
  reference_options.progress = part(0);
  BudgetAnswer answer;
  answer.reference =
      make_reference(scene, reference_tolerance(options.tolerances), options.folder, reference_options);

  const auto [finest, coarsest] = std::minmax_element(options.tolerances.begin(), options.tolerances.end());
  for (size_t i = 0; i < methods.size(); ++i) {
    const bool has_steps = methods[i].is_set_by_step;
    if (has_steps && !std::isfinite(step)) continue;  // no medium to step through
    MethodSearch search(scene, seconds, answer.reference, options);
    search.search({methods[i], 4.0 * step, has_steps ? *finest : *coarsest}, part(i + 1));
    std::move(search.runs.begin(), search.runs.end(), std::back_inserter(answer.measured));
  }
  answer.best = best_of(answer.measured, seconds);
  return answer;
}

}  // namespace pileus
