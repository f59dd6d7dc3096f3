#include "apps/scene_options.h"

#include <algorithm>

#include <fmt/format.h>

#include "apps/numbers.h"
#include "lib/core/error.h"
#include "pileus/pileus.h"

namespace pileus {

std::string size_override(const std::string& text) {
  constexpr int kMost = 65536;
  const auto size = parse_integers<2>(text, 'x');
  const auto is_size = [](int number) { return 1 <= number && number <= kMost; };
  if (!size || !std::all_of(size->begin(), size->end(), is_size)) {
    throw Error(ErrorKind::usage, SourceLoc{},
                fmt::format("--size {}; expected WIDTHxHEIGHT from 1x1 to {}x{}, such as 960x540", text,
                            kMost, kMost));
  }
  return fmt::format("render.size=[{}, {}]", (*size)[0], (*size)[1]);
}

void SceneOptions::add_input_to(CLI::App& command) {
  command.add_option("INPUT", input, "scene (.toml) or bare volume (.vdb, .nvdb, .df3, .npy, .raw)")
      ->required();
}

void SceneOptions::add_settings_to(CLI::App& command) {
  command.add_option("--set", settings, "set any value of the scene; may repeat")
      ->type_name("path.to.key=value")
      ->allow_extra_args(false);
}

void SceneOptions::add_to(CLI::App& command) {
  add_input_to(command);
  const auto overriding = [&](const char* name, const char* help, auto&& to_override) {
    return command.add_option_function<std::string>(
        name, [this, to_override](const std::string& value) { overrides.push_back(to_override(value)); },
        help);
  };
  const auto setting = [](const char* key) {
    return [key](const std::string& value) { return fmt::format("{}={}", key, value); };
  };
  overriding("--size", "picture size in pixels", size_override)->type_name("WxH");
  overriding("--tolerance", "accepted error per channel of linear radiance; 0: exact",
             setting("render.tolerance"))
      ->type_name("E");
  overriding("--integrator", "what happens along a ray: see `pileus plugins`", [](const std::string& name) {
    return fmt::format("render.integrator=\"{}\"", name);
  })->type_name("NAME");
  overriding("--seed", "seed of random numbers", setting("render.seed"))->type_name("N");
  overriding("--aov", "planes to write: beauty,transmittance,Z,samples,error_estimate,error_bound",
             [](const std::string& list) { return fmt::format("render.aovs=\"{}\"", list); })
      ->type_name("LIST");
  add_settings_to(command);
}

std::vector<std::string> SceneOptions::all_overrides() const {
  std::vector<std::string> all = overrides;
  all.insert(all.end(), settings.begin(), settings.end());
  return all;
}

Scene SceneOptions::load(double frame) const {
  return pileus::load(input, all_overrides(), frame);
}

}  // namespace pileus
