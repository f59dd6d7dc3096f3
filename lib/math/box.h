#pragma once

#include <algorithm>
#include <utility>

#include "lib/math/affine.h"
#include "lib/math/ray.h"
#include "lib/math/vec.h"

namespace pileus {

/// The part of a ray's segment inside a closed box, in the space of both; empty where the ray misses. A zero
/// component of d (of either sign) never divides: on that axis the ray is inside or outside as a whole.
inline Segment clip_to_box(const Ray& ray, Segment segment, const Box3d& box) {
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.d[axis] == 0.0) {
      if (!(ray.o[axis] >= box.min[axis] && ray.o[axis] <= box.max[axis])) return {};
      continue;
    }
    double near = (box.min[axis] - ray.o[axis]) / ray.d[axis],
           far = (box.max[axis] - ray.o[axis]) / ray.d[axis];
    if (near > far) std::swap(near, far);
    segment.t0 = std::max(segment.t0, near);
    segment.t1 = std::min(segment.t1, far);
  }
  return segment;
}

/// The box around a box that is moved, turned or stretched, but for rounding; empty where that is.
inline Box3d box_around(const Affine& placed_from_box, const Box3d& box) {
  Box3d result;
  if (box.isEmpty()) return result;
  for (int n = 0; n < 8; ++n) {
    const Vec3d corner(n & 1 ? box.max.x : box.min.x, n & 2 ? box.max.y : box.min.y,
                       n & 4 ? box.max.z : box.min.z);
    result.extendBy(placed_from_box.point(corner));
  }
  return result;
}

}  // namespace pileus
