#pragma once

#include <memory>

#include "lib/math/affine.h"
#include "lib/volume/density_field.h"
#include "lib/volume/voxel_source.h"

namespace pileus {

/// The trilinear field of voxels; their bricks are built when somebody first reads them.
///   world_from_index: any invertible affine map, in double
std::shared_ptr<const DensityField> make_grid_field(VoxelSource voxels, const Affine& world_from_index);

}  // namespace pileus
