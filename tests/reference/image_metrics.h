#pragma once

#include "lib/image/flip.h"
#include "lib/image/plane.h"

// Slow twins of the image metrics: every window and kernel is summed in two dimensions, as defined.
namespace pileus::reference {

double ssim(const Plane& test, const Plane& reference);
Plane flip_map(const RgbPlanes& test, const RgbPlanes& reference, double pixels_per_degree);

}  // namespace pileus::reference
