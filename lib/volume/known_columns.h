#pragma once

#include "lib/math/ray.h"
#include "lib/math/vec.h"

namespace pileus {

/// A field that can prove how its columns towards a sun bend from point to point.
struct KnownColumns {
  virtual ~KnownColumns() = default;

  /// Let c(t) be the integral of rho from ray.at(t) on along `towards`. Returns an upper bound of |c - line|
  /// in the part, where the line leads from c at one of its ends to c at the other; rounding of c aside [m].
  ///   ray: d has unit length
  ///   towards: unit vector
  virtual double column_bend(const Ray& ray, Segment part, const Vec3d& towards) const = 0;
};

}  // namespace pileus
