#pragma once

#include "lib/math/vec.h"

namespace pileus {

/// A half line in world space. |d| = 1, so the parameter t is a length in metres.
struct Ray {
  Vec3d o;
  Vec3d d;

  Vec3d at(double t) const { return o + t * d; }
};

/// A half-open stretch [t0, t1) of a ray [m]; empty where t1 <= t0.
struct Segment {
  double t0 = 0.0;
  double t1 = 0.0;

  bool empty() const { return !(t0 < t1); }
  double length() const { return t1 - t0; }
};

}  // namespace pileus
