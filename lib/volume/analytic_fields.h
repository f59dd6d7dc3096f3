#pragma once

#include <limits>
#include <memory>

#include "lib/math/vec.h"
#include "lib/volume/density_field.h"

namespace pileus {

// Media whose optical depth is known on paper: useful in scenes, and what the integrators are tested against.

/// Density 1 inside a box, 0 outside.
std::shared_ptr<const DensityField> make_box_field(const Box3d& box);

/// Density 1 inside an axis-aligned ellipsoid, 0 outside. radii > 0 [m].
std::shared_ptr<const DensityField> make_ellipsoid_field(const Vec3d& center, const Vec3d& radii);

/// Density exp(-(y - box.min.y) / scale_height) inside a box, 0 outside. scale_height > 0 [m].
std::shared_ptr<const DensityField> make_height_fog_field(const Box3d& box, double scale_height);

}  // namespace pileus
