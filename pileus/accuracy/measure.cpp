#include "pileus/accuracy/measure.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>

#include "integrators/default_step.h"
#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/scene/world.h"

namespace pileus {
namespace {

using Clock = std::chrono::steady_clock;

/// Planes that are looked at; of those to come, the ones that this program knows.
std::string measured_aovs() {
  std::string list = "beauty,error_estimate";
  const std::vector<std::string> known = aov_names();
  if (std::find(known.begin(), known.end(), "error_bound") != known.end()) list += ",error_bound";
  return list;
}

/// Renders, but for no longer than the limit: then none.
std::optional<Rendering> render_within_limit(const Scene& scene, RenderOptions options, double limit) {
  std::atomic<Clock::time_point> start = Clock::now();
  const auto is_late = [&] {
    return std::chrono::duration<double>(Clock::now() - start.load()).count() > limit;
  };
  const auto is_cancelled = options.is_cancelled;
  options.is_cancelled = [&] { return (is_cancelled && is_cancelled()) || is_late(); };
  const auto progress = options.progress;
  options.progress = [&](double share) {
    if (share == 0.0) start = Clock::now();  // the scene is built: every run pays for that alike
    if (progress) progress(share);
  };
  try {
    return render(scene, options);
  } catch (const Error& error) {
    const bool is_given_up = error.kind() == ErrorKind::cancelled && !(is_cancelled && is_cancelled());
    if (!is_given_up) throw;
    return std::nullopt;
  }
}

/// Weighs the runs of a study for its progress: a finer run takes longer.
class StudyProgress {
 public:
  StudyProgress(const AccuracyOptions& options, double total) : m_options(options), m_total(total) {}

  std::function<void(double)> part(double weight) {
    const double before = m_done;
    m_done += weight;
    return [this, before, weight](double share) {
      if (m_options.progress) m_options.progress(std::min(1.0, (before + weight * share) / m_total));
    };
  }

  static double weight(size_t rung) { return std::exp2(double(rung)); }
  static double weight_of_ladder(size_t rungs) { return std::exp2(double(rungs)) - 1.0; }

 private:
  const AccuracyOptions& m_options;
  double m_total, m_done = 0.0;
};

/// The settings of a method, from coarse to fine.
std::vector<AccuracySetting> ladder_of(const AccuracyMethod& method, std::vector<double> tolerances,
                                       double step) {
  constexpr double kStepFactors[] = {16.0, 8.0, 4.0, 2.0, 1.0, 0.5};
  std::sort(tolerances.begin(), tolerances.end(), std::greater<>());
  std::vector<AccuracySetting> ladder;
  if (method.is_set_by_step) {
    // The tolerance ends rays that no longer show: it must not spoil what the step gains.
    for (const double factor : kStepFactors) ladder.push_back({method, factor * step, tolerances.back()});
  } else {
    for (const double tolerance : tolerances) ladder.push_back({method, 0.0, tolerance});
  }
  return ladder;
}

/// Whether the next rung is expected to take longer than the limit: as the one before grew, or more.
bool is_too_slow(const std::vector<double>& seconds, double limit) {
  if (seconds.size() < 2) return false;
  const double last = seconds.back();
  return last * std::max(1.0, last / seconds[seconds.size() - 2]) > limit;
}

/// Measures the ladder of one method, as far as the limit allows.
void measure_ladder(const Scene& scene, const std::vector<AccuracySetting>& ladder,
                    const AccuracyOptions& options, StudyProgress& progress, AccuracyStudy& study) {
  std::vector<double> seconds;
  const size_t first = study.runs.size();
  for (size_t rung = 0; rung < ladder.size(); ++rung) {
    const auto part = progress.part(StudyProgress::weight(rung));
    if (seconds.size() != rung) continue;  // given up below
    if (is_too_slow(seconds, options.run_limit)) {
      study.notes.push_back(fmt::format("{}, and finer: not run, expected to take longer than {:g} s",
                                        to_string(ladder[rung]), options.run_limit));
      continue;
    }
    auto run = measure_setting(scene, ladder[rung], study.reference, options, part);
    if (!run) {
      study.notes.push_back(
          fmt::format("{}, and finer: given up after {:g} s", to_string(ladder[rung]), options.run_limit));
      continue;
    }
    seconds.push_back(run->render.median);
    if (study.runs.size() > first + 1) study.runs.back().picture.reset();  // neither coarsest nor finest
    study.runs.push_back(std::move(*run));
  }
}

RenderOptions render_options(const AccuracyOptions& options) {
  RenderOptions result;
  result.threads = options.threads;
  result.is_cancelled = options.is_cancelled;
  return result;
}

}  // namespace

Spread spread_of(std::vector<double> values) {
  PILEUS_CHECK(!values.empty());
  std::sort(values.begin(), values.end());
  const size_t count = values.size();
  return {0.5 * (values[(count - 1) / 2] + values[count / 2]), values.front(), values.back()};
}

double AccuracyRun::lookups() const {
  double sum = 0.0;
  for (const char* name : {"density_samples", "shadow_samples"}) {
    const auto counter = counters.find(name);
    if (counter != counters.end()) sum += double(counter->second);
  }
  return sum;
}

double reference_tolerance(const std::vector<double>& tolerances) {
  constexpr double kMuchFiner = 50.0, kDefault = 1e-5;
  return std::min(kDefault, *std::min_element(tolerances.begin(), tolerances.end()) / kMuchFiner);
}

std::optional<AccuracyRun> measure_setting(const Scene& scene, const AccuracySetting& setting,
                                           const AccuracyReference& reference, const AccuracyOptions& options,
                                           const std::function<void(double)>& progress) {
  const double runs = options.repeat + 1.0;
  const auto options_of = [&](int run) {
    RenderOptions result = render_options(options);
    result.progress = [&progress, runs, run](double share) { progress((run + share) / runs); };
    return result;
  };
  // The first run warms the caches and has all planes; those that are timed have the picture alone.
  auto rendering =
      render_within_limit(with_setting(scene, setting, measured_aovs()), options_of(0), options.run_limit);
  if (!rendering) return std::nullopt;
  const Scene timed = with_setting(scene, setting, "beauty");
  std::vector<double> total, render_alone;
  for (int run = 1; run <= options.repeat; ++run) {
    const auto seconds = render(timed, options_of(run)).report.seconds;
    render_alone.push_back(seconds.at("render"));
    total.push_back(seconds.at("build") + seconds.at("render"));
  }

  AccuracyRun result;
  result.setting = setting;
  result.total = spread_of(std::move(total));
  result.render = spread_of(std::move(render_alone));
  CompareOptions compare;
  compare.exposure_stops = scene.display.exposure_stops;
  result.difference = compare_images(rendering->image, reference.image, compare);
  result.relative_rmse = result.difference.rmse / reference.rms_radiance;
  result.counters = rendering->report.counters;
  result.estimate = judge_own_error(rendering->image, "error_estimate", reference);
  result.bound = judge_own_error(rendering->image, "error_bound", reference);
  result.is_resolved = result.difference.rmse > reference.rms_error_estimate;
  result.picture = std::make_shared<const Image>(std::move(rendering->image));
  return result;
}

AccuracyStudy measure_accuracy(const Scene& scene, const AccuracyOptions& options) {
  AccuracyStudy study;
  study.repeat = options.repeat;
  with_threads(options.threads, [&] { study.threads = thread_count(); });
  const double step = default_step(build_world(scene));
  std::vector<std::vector<AccuracySetting>> ladders;
  double weight = 0.0;
  for (const AccuracyMethod& method : chosen_methods(accuracy_methods(plugin_registry()), options.methods)) {
    if (method.is_set_by_step && !std::isfinite(step)) {
      study.notes.push_back(
          fmt::format("{}: left out, the scene has no medium to step through", method.name));
      continue;
    }
    study.methods.push_back(method);
    ladders.push_back(ladder_of(method, options.tolerances, step));
    weight += StudyProgress::weight_of_ladder(ladders.back().size());
  }

  const double reference_weight = StudyProgress::weight(options.tolerances.size() + 1);
  StudyProgress progress(options, weight + reference_weight);
  RenderOptions reference_options = render_options(options);
  reference_options.progress = progress.part(reference_weight);
  study.reference =
      make_reference(scene, reference_tolerance(options.tolerances), options.folder, reference_options);
  for (const auto& ladder : ladders) measure_ladder(scene, ladder, options, progress, study);
  if (study.runs.empty()) {
    throw Error(ErrorKind::failed, SourceLoc{},
                fmt::format("no run ended within {:g} s; make the picture smaller, or allow more",
                            options.run_limit));
  }
  return study;
}

}  // namespace pileus
