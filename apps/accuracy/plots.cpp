#include "apps/accuracy/plots.h"

#include <array>
#include <cmath>
#include <functional>

#include <fmt/format.h>

namespace pileus {
namespace {

/// Colours that remain apart for colour-blind eyes (Okabe and Ito), darkest first.
constexpr std::array<const char*, 7> kColours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                              "#e69f00", "#56b4e9", "#000000"};
constexpr std::array<int, 7> kPoints{7, 5, 9, 13, 11, 15, 3};

/// How the n-th method is drawn, in all diagrams alike.
std::string style(size_t n) {
  const size_t round = n / kColours.size();
  return fmt::format("lc rgb '{}' pt {} ps 0.7 lw 1.6 dt {}", kColours[n % kColours.size()],
                     kPoints[n % kPoints.size()], round + 1);
}

/// A gnuplot string in single quotes.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'') result += '\'';
    result += c < ' ' && c >= 0 ? ' ' : c;
  }
  return result + '\'';
}

std::string preamble(const std::string& name, const std::string& x_label, const std::string& y_label) {
  return fmt::format(
      R"(set terminal svg size 900,520 dynamic font 'sans-serif,14' background '#ffffff' name '{}'
set encoding utf8
set logscale xy
set format '10^{{%T}}'
set border 3 lc rgb '#777777'
set tics nomirror tc rgb '#333333'
set grid lc rgb '#e3e3e3' lw 1 dt 1, lc rgb '#f2f2f2' lw 1 dt 1
set key outside right top vertical Left reverse noenhanced spacing 1.25 samplen 2
set xlabel {} tc rgb '#333333'
set ylabel {} tc rgb '#333333'
)",
      name, quoted(x_label), quoted(y_label));
}

/// A named block of numbers; lines with a number that has no logarithm are left out by the caller.
std::string data_block(const std::string& name, const std::string& lines) {
  return fmt::format("${} << END_OF_DATA\n{}END_OF_DATA\n", name, lines);
}

bool is_drawable(double value) {
  return value > 0.0 && std::isfinite(value);
}

/// A grey field over the errors that the reference cannot tell, where there are any.
std::string unresolved_field(const AccuracyStudy& study) {
  for (const AccuracyRun& run : study.runs) {
    if (run.is_resolved || !is_drawable(run.difference.rmse)) continue;
    return fmt::format(
        "set object 1 rectangle from graph 0, graph 0 to first {}, graph 1 behind fc rgb '#eeeeee' fs solid "
        "noborder\n",
        study.reference.rms_error_estimate);
  }
  return "";
}

/// Cost over error for every method; runs that no other beats in this cost are ringed.
Plot cost_plot(const AccuracyStudy& study, const AccuracyAnalysis& analysis, const std::string& name,
               const std::string& y_label, const std::function<Spread(const AccuracyRun&)>& cost_of) {
  std::vector<CostError> points;
  for (const AccuracyRun& run : study.runs) points.push_back({cost_of(run).median, run.difference.rmse});
  const std::vector<bool> is_on_front = pareto_front(points);
  std::string blocks, curves, front;
  for (size_t m = 0; m < analysis.methods.size(); ++m) {
    const MethodSummary& method = analysis.methods[m];
    std::string lines;
    for (const size_t i : method.runs) {
      const Spread cost = cost_of(study.runs[i]);
      if (!is_drawable(cost.min) || !is_drawable(points[i].error)) continue;
      lines += fmt::format("{} {} {} {}\n", points[i].error, cost.median, cost.min, cost.max);
      if (is_on_front[i]) front += fmt::format("{} {}\n", points[i].error, cost.median);
    }
    if (lines.empty()) continue;
    blocks += data_block(fmt::format("method{}", m), lines);
    curves += fmt::format("{}$method{} using 1:2:3:4 with yerrorlines {} title {}",
                          curves.empty() ? "" : ", ", m, style(m), quoted(method.method.name));
  }
  if (curves.empty()) return {};
  if (!front.empty()) {
    blocks += data_block("front", front);
    curves += ", $front using 1:2 with points pt 6 ps 1.5 lw 1.2 lc rgb '#555555' title 'Pareto front'";
  }
  return {name, "",
          preamble(name, "RMSE against the reference [radiance]", y_label) + unresolved_field(study) +
              blocks + "plot " + curves + "\n"};
}

/// Error over the setting, with the fitted line, for the methods that are set by a step, or by the tolerance.
Plot convergence_plot(const AccuracyStudy& study, const AccuracyAnalysis& analysis, bool by_step) {
  std::string blocks, curves;
  for (size_t m = 0; m < analysis.methods.size(); ++m) {
    const MethodSummary& method = analysis.methods[m];
    if (method.method.is_set_by_step != by_step) continue;
    std::string lines, fitted;
    for (const size_t i : method.runs) {
      const AccuracyRun& run = study.runs[i];
      if (!is_drawable(run.difference.rmse)) continue;
      const double setting = run.setting.value();
      lines += fmt::format("{} {}\n", setting, run.difference.rmse);
      if (method.order) fitted += fmt::format("{} {}\n", setting, method.order->at(setting));
    }
    if (lines.empty()) continue;
    const std::string order = method.order ? fmt::format(", order {:.2f}", method.order->exponent) : "";
    blocks += data_block(fmt::format("method{}", m), lines);
    curves += fmt::format("{}$method{} with points {} title {}", curves.empty() ? "" : ", ", m, style(m),
                          quoted(method.method.name + order));
    if (fitted.empty()) continue;
    blocks += data_block(fmt::format("fit{}", m), fitted);
    curves += fmt::format(", $fit{} with lines lc rgb '{}' lw 1.2 notitle", m, kColours[m % kColours.size()]);
  }
  if (curves.empty()) return {};
  const std::string name = by_step ? "convergence_step" : "convergence_tolerance";
  return {
      name, "",
      preamble(name, by_step ? "step [m]" : "tolerance [radiance]", "RMSE against the reference [radiance]") +
          blocks + "plot " + curves + "\n"};
}

}  // namespace

std::vector<Plot> accuracy_plots(const AccuracyStudy& study, const AccuracyAnalysis& analysis) {
  std::vector<Plot> plots;
  const auto add = [&](Plot plot, std::string caption) {
    plot.caption = std::move(caption);
    if (!plot.script.empty()) plots.push_back(std::move(plot));
  };
  add(cost_plot(study, analysis, "error_seconds", "building and rendering [s]",
                [](const AccuracyRun& run) { return run.total; }),
      "What accuracy costs in time: down and to the left is better. Medians, with bars from the fastest to "
      "the "
      "slowest run; no run beats those with a ring. In a grey field, the reference cannot tell the error.");
  add(cost_plot(study, analysis, "error_lookups", "density look-ups",
                [](const AccuracyRun& run) { return spread_of({run.lookups()}); }),
      "What accuracy costs in work: density look-ups towards the camera and the lights, which no machine "
      "changes.");
  add(convergence_plot(study, analysis, false),
      "What the tolerance brings: the error that was reached over the error that was accepted. Lines are "
      "fits; a "
      "slope of 1 follows the tolerance in proportion.");
  add(convergence_plot(study, analysis, true),
      "What a shorter step brings. Lines are fits; their slope is the order of convergence.");
  return plots;
}

}  // namespace pileus
