#include "apps/accuracy/report.h"

#include <cmath>

#include <ctemplate/template.h>
#include <fmt/format.h>

#include "apps/accuracy/columns.h"
#include "apps/accuracy/machine.h"
#include "apps/accuracy/pictures.h"
#include "apps/accuracy/report_template.h"
#include "lib/core/error.h"
#include "lib/core/overload.h"
#include "lib/core/version.h"
#include "lib/image/difference_image.h"

namespace pileus {
namespace {

using Dictionary = ctemplate::TemplateDictionary;

/// The columns of accuracy.csv that the page shows.
constexpr std::string_view kShownColumns[] = {"method",
                                              "step",
                                              "tolerance",
                                              "rmse",
                                              "relative_rmse",
                                              "max_abs",
                                              "bias",
                                              "q999",
                                              "seconds_median",
                                              "seconds_min",
                                              "seconds_max",
                                              "render_seconds_median",
                                              "density_samples",
                                              "shadow_samples",
                                              "leaps",
                                              "psnr",
                                              "ssim",
                                              "flip",
                                              "relmse",
                                              "estimate_max",
                                              "estimate_effectivity",
                                              "estimate_exceeded",
                                              "bound_max",
                                              "bound_effectivity",
                                              "bound_exceeded"};

std::string text_of(const ReadOff& value) {
  if (value.kind == ReadOff::Kind::out_of_reach) return "–";
  return (value.kind == ReadOff::Kind::at_most ? "≤ " : "") + short_number(value.value);
}

std::string text_of(const Cell& cell) {
  return std::visit(Overload{
                        [](std::monostate) { return std::string("–"); },
                        [](const std::string& text) { return text; },
                        [](double value) { return short_number(value); },
                        [](uint64_t count) {
                          return count < 100000 ? fmt::format("{}", count) : short_number(double(count));
                        },
                    },
                    cell);
}

void add_cell(Dictionary& row, const std::string& text) {
  row.AddSectionDictionary("CELL")->SetValue("TEXT", text);
}

/// The SVG element alone: a page needs neither the XML declaration nor the name spaces.
std::string inline_svg(const std::string& document) {
  std::string svg = document.substr(std::min(document.find("<svg"), document.size()));
  for (const std::string name : {"xmlns=\"", "xmlns:xlink=\""}) {
    const size_t begin = svg.find(name);
    if (begin == svg.npos) continue;
    svg.erase(begin, svg.find('"', begin + name.size()) + 1 - begin);
  }
  return svg;
}

void fill_facts(Dictionary& page, const Scene& scene, const AccuracyStudy& study,
                const AccuracyAnalysis& analysis) {
  page["SCENE"] = scene.file;
  page["WIDTH"] = scene.render.size.x;
  page["HEIGHT"] = scene.render.size.y;
  page["THREADS"] = study.threads;
  page["REPEAT"] = study.repeat;
  page["VERSION"] = kVersion;
  page["DATE"] = date_line();
  page["MACHINE"] = machine_line();
  page["CONCLUSION"] = conclusion(study, analysis);
  if (analysis.best) {
    const MethodSummary& best = analysis.methods[*analysis.best];
    page["FIT"] = fmt::format(
        "{} takes the least time of the methods that were measured, at the middle error of the Pareto front. "
        "Over "
        "its {} runs, seconds grow as RMSE^{:.3f}; a tenth of the error then costs 10^{:.3f} times the time.",
        best.method.name, best.seconds->points, best.seconds->exponent, -best.seconds->exponent);
  }
  for (const std::string& note : study.notes) page.AddSectionDictionary("NOTE")->SetValue("TEXT", note);
}

void fill_tables(Dictionary& page, const AccuracyAnalysis& analysis) {
  for (const double level : kErrorLevels) {
    page.AddSectionDictionary("ERROR_LEVEL")->SetValue("LEVEL", short_number(level));
  }
  for (const double level : kTimeLevels) {
    page.AddSectionDictionary("TIME_LEVEL")->SetValue("LEVEL", short_number(level));
  }
  const auto price = [](const std::optional<PowerLaw>& law) {
    return law ? short_number(cost_of_a_digit(*law)) : std::string("–");
  };
  for (const MethodSummary& method : analysis.methods) {
    Dictionary& equal = *page.AddSectionDictionary("EQUAL");
    equal["METHOD"] = method.method.name;
    for (const ReadOff& seconds : method.seconds_at_error) add_cell(equal, text_of(seconds));
    for (const ReadOff& error : method.error_after) add_cell(equal, text_of(error));
    Dictionary& law = *page.AddSectionDictionary("LAW");
    law["METHOD"] = method.method.name;
    law["SET_BY"] = method.method.is_set_by_step ? "step" : "tolerance";
    law["RUNS"] = method.runs.size();
    law["ORDER"] = method.order ? fmt::format("{:.2f}", method.order->exponent) : "–";
    law["SECONDS"] = price(method.seconds);
    law["LOOKUPS"] = price(method.lookups);
  }
}

/// One run's pictures: itself, its difference, and what it says of its error beside the error it has.
void add_pictures(Dictionary& shown, const Scene& scene, const AccuracyRun& run, const Image& reference) {
  const auto add = [&](const Image& image, const DisplayTransform& display, const std::string& caption) {
    Dictionary& picture = *shown.AddSectionDictionary("PICTURE");
    picture["URI"] = data_uri(image, display);
    picture["ALT"] = caption;
    picture["CAPTION"] = caption;
  };
  const Image& image = *run.picture;
  const std::string setting = to_string(run.setting);
  add(image, scene.display, fmt::format("{}: {} s", setting, short_number(run.total.median)));
  add(difference_image(image, reference), {},
      fmt::format("difference: RMSE {}, largest {}", short_number(run.difference.rmse),
                  short_number(run.difference.max_abs)));
  const std::optional<OwnError>& own = run.bound ? run.bound : run.estimate;
  if (!own) return;
  const Channel* said = image.find(run.bound ? "error_bound" : "error_estimate");
  add(error_picture(image.width, image.height, true_errors(image, reference)), {},
      "true error: black 1e-6 or less, white 0.1 or more, by the logarithm");
  add(error_picture(image.width, image.height, said->values), {},
      fmt::format("its own {} of it, on the same scale; exceeded in {} pixels",
                  run.bound ? "bound" : "estimate", own->exceeded));
}

void fill_pictures(Dictionary& page, const Scene& scene, const AccuracyStudy& study,
                   const AccuracyAnalysis& analysis) {
  const AccuracyReference& reference = study.reference;
  page["SCALE"] = short_number(kDefaultDifferenceScale);
  page["REFERENCE"] = data_uri(reference.image, scene.display);
  page["REFERENCE_TOLERANCE"] = short_number(reference.tolerance);
  page["REFERENCE_SECONDS"] = short_number(reference.seconds);
  page["REFERENCE_REUSED"] = reference.is_reused ? " in an earlier run" : "";
  page["REFERENCE_MAX"] = short_number(reference.max_error_estimate);
  page["REFERENCE_RMS"] = short_number(reference.rms_error_estimate);
  for (const MethodSummary& method : analysis.methods) {
    Dictionary* shown = nullptr;
    for (const size_t i : method.runs) {
      if (!study.runs[i].picture) continue;
      if (!shown) shown = page.AddSectionDictionary("SHOWN");
      shown->SetValue("METHOD", method.method.name);
      add_pictures(*shown, scene, study.runs[i], reference.image);
    }
  }
}

void fill_runs(Dictionary& page, const AccuracyStudy& study, const AccuracyAnalysis& analysis) {
  std::vector<const Column*> shown;
  for (const Column& column : accuracy_columns()) {
    Dictionary& entry = *page.AddSectionDictionary("COLUMN");
    entry["NAME"] = std::string(column.name);
    entry["HELP"] = std::string(column.help);
  }
  for (const std::string_view name : kShownColumns) {
    const auto columns = accuracy_columns();
    const auto column = std::find_if(columns.begin(), columns.end(), [&](auto& c) { return c.name == name; });
    PILEUS_CHECK(column != columns.end());
    shown.push_back(&*column);
    page.AddSectionDictionary("HEAD")->SetValue("TEXT", std::string(name));
  }
  for (size_t i = 0; i < study.runs.size(); ++i) {
    const RunRow row{study.runs[i], analysis.is_on_front[i]};
    Dictionary& entry = *page.AddSectionDictionary("RUN");
    entry["CLASS"] = !row.run.is_resolved ? "unresolved" : row.is_on_front ? "front" : "";
    for (const Column* column : shown) add_cell(entry, text_of(column->value(row)));
  }
}

}  // namespace

std::string short_number(double value) {
  return fmt::format("{:.3g}", value);
}

std::string to_html(const Scene& scene, const AccuracyStudy& study, const AccuracyAnalysis& analysis,
                    const std::vector<Figure>& figures) {
  Dictionary page("accuracy report");
  fill_facts(page, scene, study, analysis);
  for (const Figure& figure : figures) {
    Dictionary& entry = *page.AddSectionDictionary("FIGURE");
    entry["SVG"] = inline_svg(figure.svg);
    entry["CAPTION"] = figure.caption;
  }
  if (figures.empty()) page.ShowSection("NO_FIGURES");
  fill_tables(page, analysis);
  fill_pictures(page, scene, study, analysis);
  fill_runs(page, study, analysis);

  constexpr const char* kName = "accuracy report";
  ctemplate::StringToTemplateCache(kName, kReportTemplate, ctemplate::DO_NOT_STRIP);
  std::string html;
  PILEUS_CHECK(ctemplate::ExpandTemplate(kName, ctemplate::DO_NOT_STRIP, &page, &html));
  return html;
}

}  // namespace pileus
