#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "lib/scene/scene.h"

namespace pileus {

/// The input and the options that change a scene before it is read; shared by the commands that take one.
/// Each option is an override of a scene key, so that there is one way in.
struct SceneOptions {
  std::filesystem::path input;
  std::vector<std::string> overrides;  ///< what --size and its like mean
  std::vector<std::string> settings;   ///< what --set says: it has the last word

  void add_to(CLI::App& command);
  void add_input_to(CLI::App& command);     ///< INPUT alone
  void add_settings_to(CLI::App& command);  ///< --set alone
  Scene load(double frame = 0.0) const;
  std::vector<std::string> all_overrides() const;
};

/// "960x540" as the scene writes it: an override. Throws Error(usage) for anything else.
std::string size_override(const std::string& text);

}  // namespace pileus
