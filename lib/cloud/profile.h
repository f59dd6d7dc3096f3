#pragma once

#include <vector>

#include "lib/math/interval.h"
#include "lib/math/vec.h"

namespace pileus {

/// A piecewise linear function through points [x, y] of rising x, constant before the first and after the
/// last. threads: const, safe from many threads
class Profile {
 public:
  /// points: at least one, x rising, all finite
  explicit Profile(std::vector<Vec2d> points) : m_points(std::move(points)) {}

  double value(double x) const;

  /// The least interval with the values over x.lo .. x.hi.
  Interval range(const Interval& x) const;

 private:
  std::vector<Vec2d> m_points;
};

}  // namespace pileus
