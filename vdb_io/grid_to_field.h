#pragma once

#include <memory>

#include <openvdb/openvdb.h>

#include "lib/math/affine.h"
#include "lib/volume/density_field.h"

namespace pileus {

/// The read-only field that the renderer sees, made from a float fog volume: topology dilated so that every
/// interpolation cell with a non-zero corner is found, then converted to NanoVDB. The grid is not modified;
/// while it is converted, memory holds it twice in OpenVDB's form and once in NanoVDB's.
///   grid: densities >= 0 and finite, background 0, affine transform (all checked by the readers and
///         builders)
///   world_from_object: placed on top of the grid's own transform
/// errors: Error(file) where the transform is singular, or where the surfaces of constant tiles need more
///         memory than there is
std::shared_ptr<const DensityField> field_from_grid(const openvdb::FloatGrid& grid,
                                                    const Affine& world_from_object);

}  // namespace pileus
