#pragma once

#include <memory>

#include <openvdb/openvdb.h>

#include "lib/math/affine.h"
#include "lib/volume/density_field.h"

namespace pileus {

/// The read-only field that the renderer sees, made from a float fog volume: topology dilated so that every
/// interpolation cell with a non-zero corner is found, then converted to NanoVDB.
///   grid: densities >= 0 and finite, background 0, affine transform (all checked by the readers and
///   builders) world_from_object: placed on top of the grid's own transform
std::shared_ptr<const DensityField> field_from_grid(const openvdb::FloatGrid& grid,
                                                    const Affine& world_from_object);

}  // namespace pileus
