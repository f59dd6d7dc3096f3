#pragma once

#include <memory>

#include <openvdb/openvdb.h>

#include "lib/math/affine.h"
#include "lib/volume/density_field.h"

namespace pileus {

/// The read-only field that the renderer sees, made from a float fog volume. The grid is kept, and must not
/// change any more: bricks are made of its voxels when somebody reads them.
///   grid: densities >= 0 and finite, background 0, affine transform (all checked by the readers and
///         builders)
///   world_from_object: placed on top of the grid's own transform
/// errors: Error(scene) where the transform is singular; those of VoxelSource
std::shared_ptr<const DensityField> field_from_grid(openvdb::FloatGrid::ConstPtr grid,
                                                    const Affine& world_from_object);

}  // namespace pileus
