#include "apps/accuracy/columns.h"

#include <fmt/format.h>

#include "lib/core/overload.h"

namespace pileus {
namespace {

Cell counter(const RunRow& row, const char* name) {
  const auto found = row.run.counters.find(name);
  return found == row.run.counters.end() ? Cell() : Cell(found->second);
}

/// Fields with a comma, a quote or a line break are quoted, quotes in them doubled.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

std::string csv_field(const Cell& cell) {
  return std::visit(Overload{
                        [](std::monostate) { return std::string(); },
                        [](const std::string& text) { return csv_field(text); },
                        [](double value) { return fmt::format("{}", value); },
                        [](uint64_t value) { return fmt::format("{}", value); },
                    },
                    cell);
}

Cell own(const std::optional<OwnError>& error, double OwnError::*figure) {
  return error ? Cell((*error).*figure) : Cell();
}

Cell effectivity(const std::optional<OwnError>& error) {
  return error && error->effectivity ? Cell(*error->effectivity) : Cell();
}

Cell exceeded(const std::optional<OwnError>& error) {
  return error ? Cell(uint64_t(error->exceeded)) : Cell();
}

#define FIGURE(expression) [](const RunRow& row) -> Cell { return Cell(expression); }

constexpr Column kColumns[] = {
    {"method", "the integrator, and after a colon what is off its default",
     FIGURE(row.run.setting.method.name)},
    {"integrator", "the plugin", FIGURE(row.run.setting.method.integrator)},
    {"step", "step length [m], where the method has one",
     [](const RunRow& row) {
       return row.run.setting.method.is_set_by_step ? Cell(row.run.setting.step) : Cell();
     }},
    {"tolerance", "render.tolerance [radiance]", FIGURE(row.run.setting.tolerance)},
    {"rmse", "root of the mean square error [radiance]", FIGURE(row.run.difference.rmse)},
    {"relative_rmse", "rmse / root mean square of the reference", FIGURE(row.run.relative_rmse)},
    {"mae", "mean absolute error [radiance]", FIGURE(row.run.difference.mae)},
    {"max_abs", "largest absolute error [radiance]", FIGURE(row.run.difference.max_abs)},
    {"bias", "mean signed error [radiance]", FIGURE(row.run.difference.bias)},
    {"q999", "99.9 % of the absolute errors are at most this [radiance]",
     FIGURE(row.run.difference.quantile_999)},
    {"relmse", "mean of d^2 / (reference^2 + 0.01)", FIGURE(row.run.difference.rel_mse)},
    {"psnr", "of the display pictures [dB]", FIGURE(row.run.difference.psnr)},
    {"ssim", "of the display pictures; 1 is alike", FIGURE(row.run.difference.ssim)},
    {"flip", "of the display pictures; 0 is alike", FIGURE(row.run.difference.flip)},
    {"nan_pixels", "pixels that cannot be compared", FIGURE(uint64_t(row.run.difference.nan_pixels))},
    {"seconds_median", "building and rendering, median of the timed runs [s]", FIGURE(row.run.total.median)},
    {"seconds_min", "the fastest of them", FIGURE(row.run.total.min)},
    {"seconds_max", "the slowest of them", FIGURE(row.run.total.max)},
    {"render_seconds_median", "rendering alone [s]", FIGURE(row.run.render.median)},
    {"render_seconds_min", "the fastest", FIGURE(row.run.render.min)},
    {"render_seconds_max", "the slowest", FIGURE(row.run.render.max)},
    {"density_samples", "density look-ups along camera rays",
     [](const RunRow& row) { return counter(row, "density_samples"); }},
    {"shadow_samples", "density look-ups along shadow rays",
     [](const RunRow& row) { return counter(row, "shadow_samples"); }},
    {"leaps", "empty nodes skipped", [](const RunRow& row) { return counter(row, "leaps"); }},
    {"estimate_max", "largest error estimate of a pixel",
     [](const RunRow& row) { return own(row.run.estimate, &OwnError::max); }},
    {"estimate_mean", "mean error estimate",
     [](const RunRow& row) { return own(row.run.estimate, &OwnError::mean); }},
    {"estimate_effectivity", "median of estimate / true error",
     [](const RunRow& row) { return effectivity(row.run.estimate); }},
    {"estimate_exceeded", "pixels whose true error is larger than the estimate",
     [](const RunRow& row) { return exceeded(row.run.estimate); }},
    {"bound_max", "largest error bound of a pixel",
     [](const RunRow& row) { return own(row.run.bound, &OwnError::max); }},
    {"bound_mean", "mean error bound", [](const RunRow& row) { return own(row.run.bound, &OwnError::mean); }},
    {"bound_effectivity", "median of bound / true error",
     [](const RunRow& row) { return effectivity(row.run.bound); }},
    {"bound_exceeded", "pixels whose true error is larger than the bound: 0, or the bound is none",
     [](const RunRow& row) { return exceeded(row.run.bound); }},
    {"is_resolved", "1 where the reference is exact enough to tell the rmse",
     FIGURE(uint64_t(row.run.is_resolved))},
    {"on_front", "1 where no other run is faster and more exact", FIGURE(uint64_t(row.is_on_front))},
};
#undef FIGURE

}  // namespace

std::span<const Column> accuracy_columns() {
  return kColumns;
}

std::string to_csv(const AccuracyStudy& study, const AccuracyAnalysis& analysis) {
  std::string csv;
  const auto append_row = [&](auto&& field_of) {
    for (const Column& column : kColumns) csv += (&column == kColumns ? "" : ",") + field_of(column);
    csv += "\r\n";
  };
  append_row([](const Column& column) { return std::string(column.name); });
  for (size_t i = 0; i < study.runs.size(); ++i) {
    const RunRow row{study.runs[i], analysis.is_on_front[i]};
    append_row([&](const Column& column) { return csv_field(column.value(row)); });
  }
  return csv;
}

}  // namespace pileus
