#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "lib/math/ray.h"

namespace pileus {

/// A ray among the lines of a grid. Where it crosses a line follows from the line's number alone, so that
/// both cells beside the line get the same parameter, bit for bit.
class GridRay {
 public:
  explicit GridRay(const Ray& ray) : m_ray(ray) {
    for (int axis = 0; axis < 2; ++axis) {
      m_inverse[size_t(axis)] = 1.0 / ray.d[axis];
      m_ahead[size_t(axis)] = ray.d[axis] > 0.0;
      if (std::isfinite(m_inverse[size_t(axis)])) continue;
      m_ray.d[axis] = 0.0;  // denormals never reach a line
      m_inverse[size_t(axis)] = 0.0;
      m_never[size_t(axis)] = std::numeric_limits<double>::infinity();
    }
  }

  const Ray& ray() const { return m_ray; }
  double z(double t) const { return m_ray.o.z + t * m_ray.d.z; }

  /// Where the ray crosses line k of an axis; infinite where it does not move along the axis.
  double at_line(int axis, int k) const {
    return (k - m_ray.o[axis]) * m_inverse[size_t(axis)] + m_never[size_t(axis)];
  }

  /// 1 where the ray goes up along an axis, else 0: line k + ahead() is where it leaves cell k.
  int ahead(int axis) const { return m_ahead[size_t(axis)]; }

  /// True where the ray is beyond a line, on the side of greater numbers, from t on for a while.
  bool is_above_line(int axis, int k, double t) const {
    const double d = m_ray.d[axis];
    if (d == 0.0) return m_ray.o[axis] >= k;
    return (t < at_line(axis, k)) == (d < 0.0);
  }

  /// The coordinate at t between lines k0 and k1, 0 to 1: exactly 0 or 1 where the ray crosses them.
  double fraction(int axis, int k0, int k1, double t) const {
    if (m_ray.d[axis] != 0.0) {
      if (t == at_line(axis, k0)) return 0.0;
      if (t == at_line(axis, k1)) return 1.0;
    }
    return std::clamp((m_ray.o[axis] + t * m_ray.d[axis] - k0) / (k1 - k0), 0.0, 1.0);
  }

  /// The part of a segment between two lines of an axis.
  Segment clip(int axis, Segment segment, int k0, int k1) const {
    if (m_ray.d[axis] == 0.0) {
      const bool is_between = m_ray.o[axis] >= k0 && m_ray.o[axis] <= k1;
      return is_between ? segment : Segment{};
    }
    const double a = at_line(axis, k0), b = at_line(axis, k1);
    return {std::max(segment.t0, std::min(a, b)), std::min(segment.t1, std::max(a, b))};
  }

  /// The part of a segment between two heights.
  Segment clip_heights(Segment segment, double least, double greatest) const {
    const double oz = m_ray.o.z, dz = m_ray.d.z;
    if (dz == 0.0) return oz >= least && oz <= greatest ? segment : Segment{};
    const double a = (least - oz) / dz, b = (greatest - oz) / dz;
    return {std::max(segment.t0, std::min(a, b)), std::min(segment.t1, std::max(a, b))};
  }

 private:
  Ray m_ray;
  std::array<double, 2> m_inverse{}, m_never{};
  std::array<int, 2> m_ahead{};
};

}  // namespace pileus
