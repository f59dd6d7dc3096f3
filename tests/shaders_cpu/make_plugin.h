#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "lib/core/param_table.h"
#include "lib/core/registry.h"

namespace pileus {

/// A parameter by name, as a scene would set it.
using ParamSetting = std::pair<std::string, std::variant<double, Vec3d>>;

/// A fresh plugin of the registry, its parameters set and committed. `problems` gets commit()'s complaints;
/// without it a complaint throws.
template <class Kind>
std::shared_ptr<Kind> make_plugin(const std::string& name, const std::vector<ParamSetting>& settings = {},
                                  std::vector<std::string>* problems = nullptr) {
  const PluginInfo* info = plugin_registry().find(Kind::kKind, name);
  if (!info) throw std::runtime_error("no plugin " + name);
  auto plugin = std::dynamic_pointer_cast<Kind>(info->make());

  ParamTable table;
  plugin->describe(table);
  for (const auto& [key, value] : settings) {
    bool found = false;
    for (Param& param : table.params()) {
      if (param.name != key) continue;
      found = true;
      if (const double* number = std::get_if<double>(&value)) *std::get<double*>(param.target) = *number;
      if (const Vec3d* vector = std::get_if<Vec3d>(&value)) *std::get<Vec3d*>(param.target) = *vector;
    }
    if (!found) throw std::runtime_error(name + " has no parameter " + key);
  }

  std::vector<std::string> complaints;
  plugin->commit(complaints);
  if (problems) *problems = complaints;
  if (!problems && !complaints.empty()) throw std::runtime_error(complaints.front());
  return plugin;
}

}  // namespace pileus
