#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "integrators/march_scene.h"

namespace pileus {

/// How the march finds out how much of each light reaches a point.
struct SunlightChoice {
  double spacing = 0.0;    ///< of the lattices' nodes [cells]; 0: shadow rays
  double step = 0.0;       ///< of shadow rays [cells]; 0: lattices
  double error = 0.0;      ///< estimated effect on a pixel of opacity 1 that gets `brightest` [radiance]
  double brightest = 0.0;  ///< MarchWorld::sunlit of the ray that gets most
  double bright = 0.0;     ///< where there are lamps: light that few rays exceed [radiance]
  std::string reason;      ///< for people

  /// Estimated effect on a pixel; where it is brighter than most, as much more.
  ///   sunlit: MarchWorld::sunlit of the ray; light: what it gets of all lights
  double error_of(double opacity, double sunlit, double light) const {
    if (bright > 0.0) return error * std::max(opacity, light / bright);
    return brightest > 0.0 ? opacity * error * sunlit / brightest : 0.0;
  }
};

/// Fills march.kernel.lattices and the faces of lamps, or sets its shadow_step, so that the effect on a pixel
/// is estimated to stay below `tolerance`, or a seventh more: `error` tells. Lattices cost a hundredth of
/// shadow rays, so they are taken wherever `most_bytes` suffice for them.
///
/// The error is measured, not guessed: along a few camera rays, at the points where most light comes from,
/// optical depths are compared with columns in steps that are short beside a voxel, shadow rays with exact
/// depths. A first lattice, coarse and cheap, tells about how fine the next has to be; where that one is
/// large, what lattices near by would err is found out at the pilots' points before it is built.
SunlightChoice choose_sunlight(const World& world, const Vec2i& picture, double tolerance, double most_bytes,
                               MarchWorld& march);

}  // namespace pileus
