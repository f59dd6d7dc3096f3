#pragma once

#include <memory>

#include "lib/math/affine.h"
#include "lib/volume/brick_grid.h"
#include "lib/volume/density_field.h"

namespace pileus {

/// The trilinear field of a brick grid.
///   world_from_index: any invertible affine map, in double
std::shared_ptr<const DensityField> make_grid_field(BrickGrid grid, const Affine& world_from_index);

}  // namespace pileus
