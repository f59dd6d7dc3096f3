#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands.h"
#include "apps/scene_options.h"
#include "lib/scene/effect_plan.h"
#include "pileus/pileus.h"

namespace pileus {
namespace {

void print_table(const Scene& scene, const EffectPlan& plan, const std::vector<std::string>& choices) {
  fmt::print("{}: {} x {} pixels, integrator {}, tolerance {}\n", scene.file, scene.render.size.x,
             scene.render.size.y, scene.render.integrator->plugin_name, scene.render.tolerance);
  for (const bool on : {true, false}) {
    fmt::print("\n{}\n", on ? "will be simulated" : "will not be simulated, and costs nothing");
    for (const Effect& effect : plan.effects) {
      if (effect.on == on) fmt::print("  {:<20} {}\n", effect.name, effect.reason);
    }
  }
  if (!choices.empty()) fmt::print("\nchosen for this scene\n");
  for (const std::string& choice : choices) fmt::print("  {}\n", choice);
}

void print_json(const Scene& scene, const EffectPlan& plan, const std::vector<std::string>& choices) {
  nlohmann::ordered_json json;
  json["scene"] = scene.file;
  json["integrator"] = scene.render.integrator->plugin_name;
  json["tolerance"] = scene.render.tolerance;
  json["effects"] = nlohmann::ordered_json::object();
  for (const Effect& effect : plan.effects) {
    json["effects"][effect.name] = {{"on", effect.on}, {"reason", effect.reason}};
  }
  json["choices"] = choices;
  // File names are bytes and need not be UTF-8, which JSON must be.
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

}  // namespace

void add_explain_command(CLI::App& app, int&) {
  struct Options {
    SceneOptions scene;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  CLI::App* sub = app.add_subcommand(
      "explain",
      "the effect plan: what will be simulated, what not, and why; and the choices of the integrator");
  options->scene.add_to(*sub);
  sub->add_flag("--json", options->json, "print JSON");
  sub->footer(
      "Examples:\n"
      "  pileus explain scene.toml\n"
      "  pileus explain smoke1.vdb --json");
  sub->callback([options] {
    const Scene scene = options->scene.load();
    const EffectPlan plan = plan_effects(scene);
    const std::vector<std::string> choices = explain_choices(scene);
    options->json ? print_json(scene, plan, choices) : print_table(scene, plan, choices);
  });
}

}  // namespace pileus
