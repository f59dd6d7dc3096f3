#pragma once

#include <filesystem>

#include <openvdb/openvdb.h>

#include "vdb_io/conversion.h"

namespace pileus {

/// The grid on new voxels, which cover the same space: the corner of the cell of voxel 0 stays where it is. A
/// new voxel holds the mean of the old ones that its cell covers, each by its share, where it is larger than
/// they are (so that the integral over space is kept), else the trilinear value at its centre; whole numbers
/// and truth values are taken from the nearest voxel. Staggered vectors become vectors at voxel centres, of
/// no class.
///   path: names the file in errors
/// errors: Error(file) where the new voxels need more than the memory budget, or are no size; for types other
/// than float, double, int32,
///         bool and vec3s
openvdb::GridBase::Ptr resampled_grid(const std::filesystem::path& path, const openvdb::GridBase& grid,
                                      const NewVoxels& voxels);

}  // namespace pileus
