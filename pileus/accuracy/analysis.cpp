#include "pileus/accuracy/analysis.h"

#include <cmath>

#include <fmt/format.h>

namespace pileus {
namespace {

MethodSummary summarize(const AccuracyStudy& study, const AccuracyMethod& method) {
  MethodSummary summary;
  summary.method = method;
  std::vector<double> settings, errors, seconds, lookups;
  std::vector<CostError> points;
  for (size_t i = 0; i < study.runs.size(); ++i) {
    const AccuracyRun& run = study.runs[i];
    if (run.setting.method.name != method.name) continue;
    summary.runs.push_back(i);
    if (!run.is_resolved) continue;
    settings.push_back(run.setting.value());
    errors.push_back(run.difference.rmse);
    seconds.push_back(run.total.median);
    lookups.push_back(run.lookups());
    points.push_back({run.total.median, run.difference.rmse});
  }
  summary.order = fit_power_law(settings, errors);
  summary.seconds = fit_power_law(errors, seconds);
  summary.lookups = fit_power_law(errors, lookups);
  for (size_t i = 0; i < kErrorLevels.size(); ++i) {
    summary.seconds_at_error[i] = cost_at_error(points, kErrorLevels[i]);
  }
  for (size_t i = 0; i < kTimeLevels.size(); ++i) {
    summary.error_after[i] = error_at_cost(points, kTimeLevels[i]);
  }
  return summary;
}

/// The geometric mean of the front's errors; 0 where none has one that the reference tells.
double middle_error(const AccuracyStudy& study, const std::vector<bool>& is_on_front) {
  double sum = 0.0;
  size_t count = 0;
  for (size_t i = 0; i < study.runs.size(); ++i) {
    if (!is_on_front[i] || !study.runs[i].is_resolved) continue;
    sum += std::log(study.runs[i].difference.rmse);
    ++count;
  }
  return count > 0 ? std::exp(sum / double(count)) : 0.0;
}

std::optional<size_t> best_method(const std::vector<MethodSummary>& methods, double error) {
  std::optional<size_t> best;
  for (size_t i = 0; i < methods.size(); ++i) {
    const auto& law = methods[i].seconds;
    if (law && (!best || law->at(error) < methods[*best].seconds->at(error))) best = i;
  }
  return error > 0.0 ? best : std::nullopt;
}

}  // namespace

AccuracyAnalysis analyse(const AccuracyStudy& study) {
  AccuracyAnalysis analysis;
  for (const AccuracyMethod& method : study.methods) analysis.methods.push_back(summarize(study, method));
  std::vector<CostError> points;
  for (const AccuracyRun& run : study.runs) points.push_back({run.total.median, run.difference.rmse});
  analysis.is_on_front = pareto_front(points);
  analysis.best = best_method(analysis.methods, middle_error(study, analysis.is_on_front));
  return analysis;
}

double cost_of_a_digit(const PowerLaw& seconds_over_error) {
  return std::pow(0.1, seconds_over_error.exponent);
}

std::string conclusion(const AccuracyStudy& study, const AccuracyAnalysis& analysis) {
  std::string text =
      "No method has two runs whose errors differ and can be told: accuracy has no price here.";
  if (analysis.best) {
    const MethodSummary& best = analysis.methods[*analysis.best];
    text = fmt::format("On this scene, ten times more accurate costs {:.3g} times the time ({}).",
                       cost_of_a_digit(*best.seconds), best.method.name);
  }
  for (const MethodSummary& method : analysis.methods) {
    if (method.runs.empty() || study.runs[method.runs.front()].is_resolved) continue;
    text += fmt::format(
        " With {}, the error is below what the reference can tell, {:.2g}, after {:.3g} s already.",
        method.method.name, study.reference.rms_error_estimate, study.runs[method.runs.front()].total.median);
  }
  return text;
}

}  // namespace pileus
