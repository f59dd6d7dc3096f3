#pragma once

#include <algorithm>
#include <utility>

#include "lib/math/ray.h"
#include "lib/math/vec.h"

namespace pileus {

/// The part of a ray's segment from which a box hides the sun, or might for all that rounding can tell: where
/// rays towards the sun meet the box. One stretch, as a box is convex; empty where there is none.
///   towards_sun: unit vector
///
/// Point p(t) is shaded where some s >= 0 has p(t) + s w in the box: six bounds of s and s >= 0, all linear
/// in t. Each lower bound must lie below each upper one: s falls out, and what is left bounds t
/// (Fourier-Motzkin). Multiplied out, so that nothing is divided by components of w.
inline Segment shadow_of_box(const Ray& ray, Segment segment, const Vec3d& towards_sun, const Box3d& box) {
  constexpr double kRounding = 1e-12;
  if (box.isEmpty()) return {};
  const double margin = kRounding * (length(ray.o) + segment.t1 + std::max(length(box.min), length(box.max)));
  Vec3d w = towards_sun, d = ray.d, low = box.min - ray.o - Vec3d(margin),
        high = box.max - ray.o + Vec3d(margin);
  for (int axis = 0; axis < 3; ++axis) {  // mirrored, so that the sun is in the positive octant
    if (!(w[axis] < 0.0)) continue;
    w[axis] = -w[axis], d[axis] = -d[axis];
    std::swap(low[axis], high[axis]);
    low[axis] = -low[axis], high[axis] = -high[axis];
  }
  bool is_met = true;
  const auto expect = [&](double rate, double most) {  // rate * t <= most
    if (rate > 0.0) segment.t1 = std::min(segment.t1, most / rate);
    if (rate < 0.0) segment.t0 = std::max(segment.t0, most / rate);
    if (rate == 0.0) is_met &= !(most < 0.0);
  };
  for (int a = 0; a < 3; ++a) {
    expect(d[a], high[a]);
    for (int b = 0; b < 3; ++b)
      if (a != b) expect(d[b] * w[a] - d[a] * w[b], high[b] * w[a] - low[a] * w[b]);
  }
  return is_met ? segment : Segment{};
}

}  // namespace pileus
