#pragma once

#include <string>
#include <vector>

#include "integrators/march_scene.h"

namespace pileus {

/// How the march finds out how much of each sun reaches a point.
struct SunCacheChoice {
  bool is_cached = false;  ///< lattices; else shadow rays
  double spacing = 0.0;    ///< of the lattices' nodes [cells]
  double error = 0.0;      ///< estimated effect on a pixel of opacity 1 [radiance]
  double bytes = 0.0;
  std::string reason;  ///< for people
};

/// Fills march.kernel.lattices so that their effect on a pixel is estimated to stay below `tolerance`, or
/// leaves them empty where that would need more than `most_bytes`.
///
/// The error is measured, not guessed: along a few camera rays, at the points where most light comes from,
/// the depth of a coarse lattice is compared with the exact one. It falls with the square of the spacing,
/// which gives the spacing that is needed; the lattices built with it are compared once more.
SunCacheChoice build_sun_cache(const World& world, const Vec2i& picture, double tolerance, double most_bytes,
                               MarchWorld& march);

}  // namespace pileus
