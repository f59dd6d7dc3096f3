#pragma once

#include <filesystem>

#include <openvdb/openvdb.h>

#include "vdb_io/dense/samples.h"

namespace pileus {

/// The sparse grid of a box of samples: float, double, vec3s or vec3d. Voxels that differ from the background
/// are active; the rest is background.
openvdb::GridBase::Ptr grid_from_dense(const DenseVolume& volume);

/// The samples in the box of a grid's active voxels, inactive ones in it included; `half` asks for 16-bit
/// floats in the file. Whole numbers become doubles.
/// errors: Error(file) where the grid is empty, its box larger than the memory budget, its transform not
/// affine, or its values are too large for half
DenseVolume dense_from_grid(const std::filesystem::path& path, const openvdb::GridBase& grid, bool half);

}  // namespace pileus
