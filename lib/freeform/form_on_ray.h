#pragma once

#include "lib/freeform/free_form.h"
#include "lib/math/interval.h"
#include "lib/math/ray.h"

namespace pileus {

/// Bounds of f along a stretch of a ray, and of its derivative with respect to t; rounding included.
struct RayRange {
  Interval f, slope;
};

/// Bernstein bounds of quadrics and what follows from them (METHODS 4.3); through a deformation, where f is
/// no polynomial, bounds over boxes, and none for the slope.
RayRange range_on_ray(const FreeForm& form, const Ray& ray, const Segment& segment);

/// The same for a node of a form on the line o + t d, t in an interval about 0.
RayRange range_on_line(const FormProgram& program, int index, const Vec3d& o, const Vec3d& d,
                       const Interval& t);

}  // namespace pileus
