#pragma once

#include <algorithm>
#include <utility>

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

}  // namespace pileus
