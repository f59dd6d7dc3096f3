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
  Scene load() const;
};

}  // namespace pileus
