#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "lib/math/affine.h"
#include "vdb_io/vdb_directory.h"

namespace pileus {

enum class LevelSetPolicy { refuse, to_fog };
enum class BadValuePolicy { refuse, to_zero };

struct VdbReadOptions {
  std::string
      grid;  ///< "density", "density[1]" where names repeat, "": the one that is meant (see choose_grid)
  LevelSetPolicy level_set = LevelSetPolicy::refuse;
  BadValuePolicy bad_values = BadValuePolicy::refuse;  ///< NaN, infinite and negative densities
};

/// Values of a grid that a density must not have, active or not: interpolation sees both. A tile counts with
/// all its voxels.
struct ValueCounts {
  uint64_t nan = 0, infinite = 0, negative = 0;
  uint64_t inactive_nonzero = 0;
  double min = 0.0, max = 0.0;  ///< over the finite values of active voxels; 0 where there are none

  uint64_t bad() const { return nan + infinite + negative; }
};

struct DensityGrid {
  openvdb::FloatGrid::Ptr grid;  ///< fog volume: values finite and >= 0, background 0, affine transform
  VdbGridEntry source;           ///< what the file says about it
  ValueCounts values;  ///< as found in the file (before bad values became 0, after a level set became fog)
  std::vector<std::string> notes;  ///< what was chosen or converted on the way, a sentence each
};

/// The grid that `wanted` names, or, where it is "", the one that a file without instructions means:
/// "density", else its only scalar fog volume (a scalar grid of unknown class counts as one). errors:
/// Error(file) that lists what there is
const VdbGridEntry& choose_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                const std::string& wanted);

/// Reads one density grid; other grids of the file are not touched. Every scalar type becomes float (true is
/// 1). Inactive voxels keep their values, since interpolation reads them as it reads active ones. errors:
/// Error(file) for damaged files, grids that are no density, frustum or singular transforms, empty grids,
///         bad values under BadValuePolicy::refuse, a background that is not 0
DensityGrid read_density_grid(const std::filesystem::path& path, const VdbReadOptions& options = {});

/// Any scalar grid of the file as float, unchanged but for its type: what an inspection looks at.
openvdb::FloatGrid::Ptr read_scalar_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                         const VdbGridEntry& entry);

ValueCounts count_values(const openvdb::FloatGrid& grid);

/// A grid without its voxels: transform and metadata of whatever type.
openvdb::GridBase::Ptr read_grid_without_voxels(const std::filesystem::path& path, const VdbGridEntry& entry);

/// The transform of a grid that has an affine one, in double. Throws Error(file) where it is singular or not
/// finite.
Affine world_from_index(const std::filesystem::path& path, const openvdb::GridBase& grid);

}  // namespace pileus
