#pragma once

#include <span>

#include "lib/volume/brick_pyramid.h"

namespace pileus::bench {

/// Positions in a grid, local to its pyramid [cells]; as many as fill whole vectors of any size.
struct Positions {
  std::span<const float> x, y, z;
};

/// The sum of the densities there, read as the march reads them.
float sum_densities(const BrickPyramid& pyramid, const Positions& at);

}  // namespace pileus::bench
