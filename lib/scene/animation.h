#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "lib/scene/scene.h"

namespace pileus {

// Scenes over time. Any number of a scene file, alone or in an array, may be given by keyframes,
//   { times = [1, 48], values = [0.2, 0.5], interpolation = "smooth" }
// with times in frames: linear or smooth in between, constant before the first and after the last. What is
// not told otherwise reads a scene at frame 0.

/// load_scene at a frame. Throws as it does.
Scene load_scene(const std::filesystem::path& file, const std::vector<std::string>& overrides, double frame);

/// By name, what the densities of a scene's volumes are made of at a frame: the same keys at two frames, the
/// same densities. Files that the scene names are taken not to change meanwhile.
std::map<std::string, uint64_t> volume_keys(const std::filesystem::path& file,
                                            const std::vector<std::string>& overrides, double frame);

/// parse_scene at a frame.
Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& folder,
                  const std::vector<std::string>& overrides, double frame);

}  // namespace pileus
