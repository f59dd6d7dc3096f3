#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/math/affine.h"
#include "lib/math/ray.h"
#include "lib/math/vec.h"

namespace pileus {

/// Several rays as one: intervals that hold their origins and directions.
struct Beam {
  Box3d o, d;

  /// Where some of the rays may be in a box, t >= 0: interval arithmetic on its slabs. Empty where none
  /// meets it; infinite where they part so widely that the intervals never leave it.
  Segment inside(const Box3d& box) const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity(), kRounding = 1e-12;
    constexpr Segment kNowhere{kInfinity, 0.0};
    Segment inside{0.0, kInfinity};
    for (int axis = 0; axis < 3; ++axis) {
      const double up = box.min[axis] - o.max[axis], down = o.min[axis] - box.max[axis];
      if (up > 0.0) {
        if (!(d.max[axis] > 0.0)) return kNowhere;
        inside.t0 = std::max(inside.t0, up / d.max[axis]);
      }
      if (down > 0.0) {
        if (!(d.min[axis] < 0.0)) return kNowhere;
        inside.t0 = std::max(inside.t0, down / -d.min[axis]);
      }
      if (d.min[axis] > 0.0) inside.t1 = std::min(inside.t1, (box.max[axis] - o.min[axis]) / d.min[axis]);
      if (d.max[axis] < 0.0) inside.t1 = std::min(inside.t1, (o.max[axis] - box.min[axis]) / -d.max[axis]);
    }
    inside.t0 *= 1.0 - kRounding;
    inside.t1 *= 1.0 + kRounding;
    return inside.empty() ? kNowhere : inside;
  }

  /// A box that holds all rays between t0 and t1, t0 >= 0.
  Box3d box(double t0, double t1) const {
    Box3d result(o.min + t0 * d.min, o.max + t0 * d.max);
    result.extendBy(o.min + t1 * d.min);
    result.extendBy(o.max + t1 * d.max);
    return result;
  }
};

/// A beam that also holds rays that are off by a few roundings of its coordinates.
inline Beam rounded_outwards(Beam beam) {
  constexpr double kRounding = 1e-14;
  for (Box3d* box : {&beam.o, &beam.d}) {
    for (int axis = 0; axis < 3; ++axis) {
      const double margin = kRounding * (1.0 + std::max(std::abs(box->min[axis]), std::abs(box->max[axis])));
      box->min[axis] -= margin;
      box->max[axis] += margin;
    }
  }
  return beam;
}

/// A beam that holds the rays of another, seen from another space.
inline Beam seen_from(const Affine& to_from, const Beam& beam) {
  const Vec3d zero = to_from.point(Vec3d(0.0));
  Beam seen{{zero, zero}, {Vec3d(0.0), Vec3d(0.0)}};
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d unit(0.0);
    unit[axis] = 1.0;
    const Vec3d column = to_from.direction(unit);
    for (int row = 0; row < 3; ++row) {
      const auto add = [&](const Box3d& from, Box3d& to) {
        const double a = column[row] * from.min[axis], b = column[row] * from.max[axis];
        to.min[row] += std::min(a, b);
        to.max[row] += std::max(a, b);
      };
      add(beam.o, seen.o);
      add(beam.d, seen.d);
    }
  }
  return seen;
}

}  // namespace pileus
