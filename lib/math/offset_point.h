#pragma once

#include <limits>

#include "lib/math/vec.h"

namespace pileus {

// Secondary rays must not hit the surface they start on. A fixed epsilon is too small far from the origin and
// too large near it. Here each shape states, with every hit, how far the computed point can lie from the
// surface as its own intersection test would see it; the secondary ray starts twice as far out, on the
// viewer's side. On a convex surface a ray that leaves on that side then has no hit at any t > 0: no test
// needs an epsilon of its own.

/// Distance [m] by which rounding may move a hit off its surface: 16 roundings of the largest lengths that
/// went into it. `scale` is the sum of those lengths: the ray's origin, the distance travelled, the object's
/// size and place.
inline double surface_error(double scale) {
  return 8.0 * std::numeric_limits<double>::epsilon() * scale;  // epsilon = 2 u
}

/// Where a secondary ray starts: off the hit point p along the unit normal n of the viewer's side, farther
/// than `error`, the hit's own bound [m].
inline Vec3d offset_point(const Vec3d& p, const Vec3d& n, double error) {
  return p + 2.0 * error * n;
}

}  // namespace pileus
