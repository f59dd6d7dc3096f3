#include <nlohmann/json.hpp>

#include "lib/core/version.h"
#include "pileus/pileus.h"

namespace pileus {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json effects_to_json(const RenderReport& report) {
  Json effects = Json::object();
  for (const Effect& effect : report.effects) {
    const auto counted = report.counters.find(effect.counter);
    effects[effect.name] = {
        {"on", effect.on},
        {"reason", effect.reason},
        {"count", counted == report.counters.end() ? Json(nullptr) : Json(counted->second)}};
  }
  return effects;
}

}  // namespace

std::string to_json(const RenderReport& report) {
  Json json;
  json["version"] = kVersion;
  json["scene"] = report.scene;
  json["integrator"] = report.integrator;
  json["tolerance"] = report.tolerance;
  json["coarseness"] = report.coarseness;
  json["threads"] = report.threads;
  json["seconds"] = report.seconds;
  json["peak_memory_bytes"] = report.peak_memory_bytes;
  json["pixels"] = report.pixels;
  json["rays"] = report.rays;
  json["counters"] = report.counters;
  json["effects"] = effects_to_json(report);
  json["choices"] = report.choices;
  json["error_bound"] = {{"max", or_null(report.max_error_bound)},
                         {"mean", or_null(report.mean_error_bound)}};
  json["error_estimate"] = {{"max", or_null(report.max_error_estimate)},
                            {"mean", or_null(report.mean_error_estimate)}};
  json["nan_pixels"] = report.nan_pixels;
  json["warnings"] = report.warnings;
  // File names are bytes and need not be UTF-8, which JSON must be.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace pileus
