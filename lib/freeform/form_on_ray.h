#pragma once

#include "lib/freeform/free_form.h"
#include "lib/math/interval.h"
#include "lib/math/ray.h"
#include "lib/math/segments.h"

namespace pileus {

/// Bounds of f along a stretch of a ray, and of its derivative with respect to t; rounding included.
struct RayRange {
  Interval f, slope;
};

/// Bernstein bounds of quadrics and what follows from them (METHODS 4.3); through a deformation, where f is
/// no polynomial, bounds over boxes, and none for the slope.
RayRange range_on_ray(const FreeForm& form, const Ray& ray, const Segment& segment);

/// The stretches of a segment that lie in the solid. No crossing is missed whose depth is beyond rounding; of
/// a ray that only touches the solid a stretch may be told or not (METHODS 5.4, 5.5). Ends are as exact as
/// points of the ray.
/// ref: METHODS 5.3 (range and monotonicity, near first), 4.5 (operands of sharp joins on their own)
Segments inside(const FreeForm& form, const Ray& ray, const Segment& segment);

}  // namespace pileus
