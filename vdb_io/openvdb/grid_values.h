#pragma once

#include <cstdint>
#include <filesystem>

#include <openvdb/openvdb.h>

#include "lib/math/affine.h"

namespace pileus {

/// Values of a grid that a density must not have, active or not: interpolation sees both. A tile counts with
/// all its voxels.
struct ValueCounts {
  uint64_t nan = 0, infinite = 0, negative = 0;
  uint64_t inactive_nonzero = 0;
  double min = 0.0, max = 0.0;  ///< over the finite values of active voxels; 0 where there are none

  uint64_t bad() const { return nan + infinite + negative; }
};

ValueCounts count_values(const openvdb::FloatGrid& grid);

/// The transform of a grid that has an affine one, in double. Throws Error(file) where it is singular or not
/// finite.
Affine world_from_index(const std::filesystem::path& path, const openvdb::GridBase& grid);

/// Lengths of a voxel's three edges [m].
Vec3d voxel_edges(const Affine& world_from_index);

}  // namespace pileus
