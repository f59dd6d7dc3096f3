#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/math/ray.h"

namespace pileus {

/// A box of cells, [lo, hi).
struct CellBox {
  Vec3i lo, hi;
};

/// Steps from cell to cell along a ray in index space. Every crossing parameter comes from the integer plane,
/// never from the one before, so no error piles up; each step enters the cell behind a plane, so it always
/// moves on; and the lengths add up to the whole by telescoping (METHODS §9.6). Axes along which the ray does
/// not move are never crossed.
class CellStepper {
 public:
  CellStepper(const Ray& index_ray, const Vec3i& first_cell) : cell(first_cell), m_ray(index_ray) {
    for (int axis = 0; axis < 3; ++axis) {
      // A component whose reciprocal overflows moves the ray as little as 0 does.
      m_inverse[axis] = std::isfinite(1.0 / m_ray.d[axis]) ? 1.0 / m_ray.d[axis] : 0.0;
      m_forward[axis] = m_ray.d[axis] > 0.0;
    }
    for (int axis = 0; axis < 3; ++axis) m_exit[axis] = crossing(axis, cell[axis] + m_forward[axis]);
  }

  /// Where the ray leaves the present cell.
  double t_exit() const { return m_exit[exit_axis()]; }

  /// Enters the next cell; returns the axis of the plane that was crossed.
  int step() {
    const int axis = exit_axis();
    cell[axis] += m_forward[axis] ? 1 : -1;
    m_exit[axis] = crossing(axis, cell[axis] + m_forward[axis]);
    return axis;
  }

  /// Where the ray leaves a box of cells around the present one.
  double exit_of(const CellBox& box, int& axis) const {
    double t = std::numeric_limits<double>::infinity();
    axis = 0;
    for (int k = 0; k < 3; ++k) {
      const double t_k = crossing(k, m_forward[k] ? box.hi[k] : box.lo[k]);
      if (t_k < t) t = t_k, axis = k;
    }
    return t;
  }

  /// Enters the cell behind the plane of `axis` through which the ray leaves the box at t. The other two
  /// indices come from the position, kept inside the box just left.
  void leap(const CellBox& box, int axis, double t) {
    for (int k = 0; k < 3; ++k) {
      const double p = std::floor(m_ray.o[k] + t * m_ray.d[k]);
      cell[k] = int(std::clamp(p, double(box.lo[k]), double(box.hi[k] - 1)));
    }
    cell[axis] = m_forward[axis] ? box.hi[axis] : box.lo[axis] - 1;
    for (int k = 0; k < 3; ++k) m_exit[k] = crossing(k, cell[k] + m_forward[k]);
  }

  Vec3i cell;

 private:
  double crossing(int axis, int plane) const {
    return m_inverse[axis] == 0.0 ? std::numeric_limits<double>::infinity()
                                  : (plane - m_ray.o[axis]) * m_inverse[axis];
  }
  int exit_axis() const {
    if (m_exit[0] <= m_exit[1]) return m_exit[0] <= m_exit[2] ? 0 : 2;
    return m_exit[1] <= m_exit[2] ? 1 : 2;
  }

  const Ray& m_ray;
  double m_inverse[3], m_exit[3];
  bool m_forward[3];
};

}  // namespace pileus
