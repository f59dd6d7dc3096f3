#pragma once

#include <array>
#include <cmath>

#include "lib/freeform/quadric.h"
#include "lib/math/ray.h"

namespace pileus {

/// A line whose parameter is counted from a point near what it shall meet, that point being known to twice
/// double precision: a ray that starts far away loses nothing.
struct AnchoredRay {
  Vec3d point, rest;  ///< at t = 0: point + rest
  Vec3d d;            ///< |d| = 1
  double rounding;    ///< [m] how far point + rest may lie from the ray

  AnchoredRay(const Ray& ray, double t);
};

/// q(t) = c + b u + a u² with u = t - at, and how far rounding may carry values and Bernstein coefficients
/// from those of the exact quadric on the exact ray: margin0 + margin1 |u| + margin2 u².
struct QuadraticOnRay {
  double at, a, b, c;
  double margin0, margin1, margin2;

  double value(double t) const {
    const double u = t - at;
    return c + u * (b + a * u);
  }
  double slope(double t) const { return b + 2 * a * (t - at); }

  /// Bernstein coefficients between two parameters: their hull holds all values (METHODS 4.3).
  std::array<double, 3> bernstein(double t0, double t1) const {
    const double u0 = t0 - at, u1 = t1 - at;
    return {c + u0 * (b + a * u0), c + 0.5 * b * (u0 + u1) + a * u0 * u1, c + u1 * (b + a * u1)};
  }

  double margin(double t) const {
    const double u = std::fabs(t - at);
    return margin0 + u * (margin1 + margin2 * u);
  }

  /// Margins of the Bernstein coefficients.
  std::array<double, 3> bernstein_margins(double t0, double t1) const {
    const double u0 = std::fabs(t0 - at), u1 = std::fabs(t1 - at);
    return {margin(t0), margin0 + 0.5 * margin1 * (u0 + u1) + margin2 * u0 * u1, margin(t1)};
  }

  /// Up to two stretches with q > 0.
  struct Stretches {
    int count = 0;
    std::array<Segment, 2> parts;
  };
  Stretches positive(const Segment& within) const;
};

/// A quadric laid out for many rays.
class TracedQuadric {
 public:
  explicit TracedQuadric(const Quadric& quadric);

  /// False where q > 0 nowhere on the ray: {q > 0} lies in a ball that the ray does not meet.
  bool may_be_positive(const AnchoredRay& ray) const;

  /// The same of a point.
  bool may_be_positive(const Vec3d& p) const { return !((p - m_ball_center).length2() > m_ball_square); }

  /// The quadric at a point, and how far rounding may carry its value there.
  struct AtPoint {
    double value;
    Vec3d gradient;  ///< [1/m]
    double margin;
  };
  AtPoint at(const Vec3d& p) const;

  /// The quadric along a ray, its parameter counted from the point of `within` that is nearest to the
  /// quadric's centre, in its own coordinates.
  QuadraticOnRay along(const AnchoredRay& ray, const Segment& within) const;

  /// For those who meet many rays at once: local coordinates row(k) (p - center) and what goes with them.
  const Vec3d& center() const { return m_center; }
  const Vec3d& row(size_t k) const { return m_rows[k]; }
  const Vec3d& row_lengths() const { return m_row_lengths; }
  const QuadricCoefficients& coefficients() const { return m_q; }
  const QuadricCoefficients& magnitudes() const { return m_absolute; }  ///< of the coefficients
  const Vec3d& ball_center() const { return m_ball_center; }
  double ball_square() const { return m_ball_square; }

  /// A box around {q > 0}, to rounding; infinite where that has no end.
  const Box3d& bounds() const { return m_bounds; }

  /// Roundings between a point of the ray and a value, relative to sums of absolute terms: 5 for the offset
  /// from the centre, 5 for local coordinates, 4 for the way to `at`; 12 for coefficients, 6 for the value.
  static constexpr double kRoundings = 24.0;

 private:
  Vec3d m_center;
  std::array<Vec3d, 3> m_rows;
  Vec3d m_row_lengths;
  QuadricCoefficients m_q, m_absolute;
  Vec3d m_ball_center;
  Box3d m_bounds;
  double m_ball_square;  ///< of the radius [m²]; infinite where {q > 0} has no end
};

}  // namespace pileus
