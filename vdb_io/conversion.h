#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "lib/math/vec.h"
#include "vdb_io/write_options.h"

namespace pileus {

/// New voxels: cubes of an edge in metres, or a multiple of the old edges.
struct VoxelEdge {
  double meters;
};
struct VoxelFactor {
  double factor;
};
using NewVoxels = std::variant<VoxelEdge, VoxelFactor>;

/// Values for grids by name.
using GridNumbers = std::vector<std::pair<std::string, double>>;

/// What happens to grids on their way from files to a file, in this order.
struct GridChanges {
  bool level_set_to_fog = false;
  GridNumbers nan, lowest, factors, backgrounds;  ///< of replace_nan, raise_to, … (grid_edits.h)
  std::optional<Box3d> crop;                      ///< [m]
  double scale = 1.0;
  std::optional<NewVoxels> voxels;
  std::vector<std::pair<std::string, std::string>> renamings;  ///< old name, new name
};

/// Grids of one file, or of several, for a new file.
struct Conversion {
  std::filesystem::path input, output;
  std::vector<std::filesystem::path> merged;  ///< more inputs
  std::vector<std::string> grids;             ///< those to take, by name or alias; none: all
  GridChanges changes;
  VolumeWriteOptions write;
};

/// Hears of what was chosen, changed or left out, a sentence each.
using Tell = std::function<void(const std::string&)>;

}  // namespace pileus
