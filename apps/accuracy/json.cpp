#include <nlohmann/json.hpp>

#include "apps/accuracy/columns.h"
#include "apps/accuracy/machine.h"
#include "apps/accuracy/report.h"
#include "lib/core/overload.h"
#include "lib/core/version.h"

namespace pileus {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Cell& cell) {
  return std::visit(Overload{
                        [](std::monostate) { return Json(nullptr); },
                        [](const auto& value) { return Json(value); },
                    },
                    cell);
}

Json to_json(const std::optional<PowerLaw>& law) {
  if (!law) return nullptr;
  return {{"factor", law->factor}, {"exponent", law->exponent}, {"points", law->points}};
}

Json to_json(const ReadOff& value) {
  if (value.kind == ReadOff::Kind::out_of_reach) return nullptr;
  return {{"value", value.value}, {"is_upper_bound", value.kind == ReadOff::Kind::at_most}};
}

Json to_json(const MethodSummary& method) {
  Json json{{"method", method.method.name},
            {"set_by", method.method.is_set_by_step ? "step" : "tolerance"},
            {"rmse_over_setting", to_json(method.order)},
            {"seconds_over_rmse", to_json(method.seconds)},
            {"lookups_over_rmse", to_json(method.lookups)}};
  for (size_t i = 0; i < kErrorLevels.size(); ++i) {
    json["seconds_at_rmse"][fmt::format("{:g}", kErrorLevels[i])] = to_json(method.seconds_at_error[i]);
  }
  for (size_t i = 0; i < kTimeLevels.size(); ++i) {
    json["rmse_after_seconds"][fmt::format("{:g}", kTimeLevels[i])] = to_json(method.error_after[i]);
  }
  return json;
}

}  // namespace

std::string to_json(const Scene& scene, const AccuracyStudy& study, const AccuracyAnalysis& analysis) {
  const AccuracyReference& reference = study.reference;
  Json json{{"version", kVersion},
            {"scene", scene.file},
            {"size", {scene.render.size.x, scene.render.size.y}},
            {"threads", study.threads},
            {"repeat", study.repeat},
            {"machine", machine_line()},
            {"conclusion", conclusion(study, analysis)}};
  json["best"] = analysis.best ? Json(analysis.methods[*analysis.best].method.name) : Json(nullptr);
  json["cost_of_a_digit"] =
      analysis.best ? Json(cost_of_a_digit(*analysis.methods[*analysis.best].seconds)) : Json(nullptr);
  json["reference"] = {
      {"integrator", "exact"},
      {"tolerance", reference.tolerance},
      {"seconds", reference.seconds},
      {"is_reused", reference.is_reused},
      {"error_estimate", {{"max", reference.max_error_estimate}, {"rms", reference.rms_error_estimate}}}};
  json["methods"] = Json::array();
  for (const MethodSummary& method : analysis.methods) json["methods"].push_back(to_json(method));
  json["runs"] = Json::array();
  for (size_t i = 0; i < study.runs.size(); ++i) {
    Json run;
    for (const Column& column : accuracy_columns()) {
      run[std::string(column.name)] = to_json(column.value({study.runs[i], analysis.is_on_front[i]}));
    }
    json["runs"].push_back(std::move(run));
  }
  json["notes"] = study.notes;
  // File names are bytes and need not be UTF-8, which JSON must be.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace pileus
