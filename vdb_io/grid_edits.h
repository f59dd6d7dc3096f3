#pragma once

#include <filesystem>
#include <variant>

#include <openvdb/openvdb.h>

#include "lib/math/vec.h"

namespace pileus {

/// Sets everything outside a world-space box to the background: a voxel stays where its centre is in the box.
///   path: names the file in errors
/// errors: Error(file) where the grid's axes are not the world's
void crop_grid(const std::filesystem::path& path, openvdb::GridBase& grid, const Box3d& box);

/// New voxels: cubes of an edge in metres, or a multiple of the old edges.
struct VoxelEdge {
  double meters;
};
struct VoxelFactor {
  double factor;
};
using NewVoxels = std::variant<VoxelEdge, VoxelFactor>;

/// The grid on new voxels, which cover the same space: the corner of the cell of voxel 0 stays where it is. A
/// new voxel holds the mean of the trilinear density over its cell where it is larger than the old ones (so
/// that the integral over space is kept), else the value at its centre; whole numbers and truth values are
/// taken from the nearest voxel. Staggered vectors become vectors at voxel centres, of no class.
/// errors: Error(file) where new voxels are more than `most_voxels`, or are no size; for types other than
///         float, double, int32, bool and vec3s
openvdb::GridBase::Ptr resampled_grid(const std::filesystem::path& path, const openvdb::GridBase& grid,
                                      const NewVoxels& voxels, uint64_t most_voxels = uint64_t(1) << 31);

}  // namespace pileus
