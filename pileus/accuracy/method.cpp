#include "pileus/accuracy/method.h"

#include <algorithm>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/core/param_table.h"

namespace pileus {
namespace {

/// The values of a parameter that are worth a comparison with its default, as a scene spells them.
std::vector<std::string> other_values(const Param& param) {
  if (const auto* truth = std::get_if<bool*>(&param.target)) return {**truth ? "false" : "true"};
  const auto* text = std::get_if<std::string*>(&param.target);
  std::vector<std::string> values;
  if (!text) return values;
  for (const std::string& choice : param.choices) {
    if (choice != **text) values.push_back(fmt::format("\"{}\"", choice));
  }
  return values;
}

bool is_step(const Param& param) {
  return param.name == "step" && std::holds_alternative<double*>(param.target);
}

std::string without_quotes(std::string text) {
  std::erase(text, '"');
  return text;
}

}  // namespace

std::vector<AccuracyMethod> accuracy_methods(const Registry& registry) {
  std::vector<AccuracyMethod> methods;
  for (const PluginInfo& info : registry.all()) {
    if (info.kind != Integrator::kKind) continue;
    const std::shared_ptr<Plugin> plugin = info.make();
    ParamTable params;
    plugin->describe(params);
    AccuracyMethod plain{info.name, info.name, "", "", false};
    plain.is_set_by_step = std::any_of(params.params().begin(), params.params().end(), is_step);
    methods.push_back(plain);
    for (const Param& param : params.params()) {
      for (const std::string& value : other_values(param)) {
        AccuracyMethod& method = methods.emplace_back(plain);
        method.name = fmt::format("{}:{}={}", info.name, param.name, without_quotes(value));
        method.parameter = param.name;
        method.value = value;
      }
    }
  }
  return methods;
}

std::vector<AccuracyMethod> chosen_methods(const std::vector<AccuracyMethod>& all,
                                           const std::vector<std::string>& names) {
  if (names.empty()) return all;
  std::vector<std::string> known;
  for (const AccuracyMethod& method : all) known.push_back(method.name);
  for (const std::string& name : names) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    const std::string nearest = nearest_name(name, known);
    throw Error(ErrorKind::usage, SourceLoc{},
                fmt::format("unknown method \"{}\"; expected {}{}", name, join_or(known),
                            nearest.empty() ? "" : "; nearest: " + nearest));
  }
  std::vector<AccuracyMethod> chosen;
  std::copy_if(all.begin(), all.end(), std::back_inserter(chosen), [&](const AccuracyMethod& method) {
    return std::find(names.begin(), names.end(), method.name) != names.end();
  });
  return chosen;
}

std::string integrator_text(const AccuracySetting& setting) {
  const AccuracyMethod& method = setting.method;
  std::string text = fmt::format("{{ type = \"{}\"", method.integrator);
  if (!method.parameter.empty()) text += fmt::format(", {} = {}", method.parameter, method.value);
  if (method.is_set_by_step) text += fmt::format(", step = {}", setting.step);
  return text + " }";
}

Scene with_setting(Scene scene, const AccuracySetting& setting, std::string aovs) {
  // Through the one reader of scenes, which knows how to make, check and commit a plugin.
  const std::string text =
      fmt::format("pileus = 1\ncamera = \"perspective\"\nrender.integrator = {}\n", integrator_text(setting));
  scene.render.integrator = parse_scene(text, setting.method.name, "").render.integrator;
  scene.render.tolerance = setting.tolerance;
  scene.render.aovs = std::move(aovs);
  return scene;
}

std::string to_string(const AccuracySetting& setting) {
  return setting.method.is_set_by_step
             ? fmt::format("{}, step {:.4g} m", setting.method.name, setting.step)
             : fmt::format("{}, tolerance {:.4g}", setting.method.name, setting.tolerance);
}

}  // namespace pileus
