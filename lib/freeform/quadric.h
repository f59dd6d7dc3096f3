#pragma once

#include "lib/freeform/frame.h"
#include "lib/math/interval.h"
#include "lib/math/vec.h"

namespace pileus {

/// Coefficients of a quadratic in three variables; cross terms are not doubled (METHODS 4.1):
///   a11 x² + a22 y² + a33 z² + a12 xy + a13 xz + a23 yz + a14 x + a24 y + a34 z + a44
/// Unchanged they make the unit ball, 1 - x² - y² - z².
struct QuadricCoefficients {
  double a11 = -1.0, a22 = -1.0, a33 = -1.0;
  double a12 = 0.0, a13 = 0.0, a23 = 0.0;
  double a14 = 0.0, a24 = 0.0, a34 = 0.0;
  double a44 = 1.0;

  double value(const Vec3d& p) const;
  Vec3d gradient(const Vec3d& p) const;

  /// The sum of the absolute values of all terms, where |coordinate k| <= reach[k]: the scale of rounding.
  double magnitude(const Vec3d& reach) const;
  Vec3d magnitude_gradient(const Vec3d& reach) const;  ///< that of its derivatives

  double square(int axis) const { return axis == 0 ? a11 : axis == 1 ? a22 : a33; }
  double linear(int axis) const { return axis == 0 ? a14 : axis == 1 ? a24 : a34; }
  bool has_cross_terms() const { return a12 != 0.0 || a13 != 0.0 || a23 != 0.0; }
};

/// Coefficient by coefficient.
QuadricCoefficients absolute(const QuadricCoefficients& q);

/// A quadric about the centre of a box, Q(center + v) for |v[k]| <= half[k], and how far rounding may carry a
/// value in double from it.
struct QuadricInBox {
  QuadricCoefficients about_center;
  Vec3d half;
  double margin = 0.0;

  /// Bounds of the exact values and of those that Quadric::value computes (METHODS 4.4); for points given in
  /// single precision as well where `unit_roundoff` is that of float.
  Interval range(double unit_roundoff = 0.0) const;
};

/// A quadric function in a frame: Q(p) = coefficients at the frame's local coordinates; inside is Q >= 0.
/// ref:     METHODS 4.1, 4.4
/// threads: const calls are safe from many threads
class Quadric {
 public:
  Quadric() : Quadric(Frame(), {}) {}  ///< the unit ball
  Quadric(const Frame& frame, const QuadricCoefficients& coefficients);

  /// Q at a point [1].
  double value(const Vec3d& p) const { return m_local.value(m_frame.local_point(p)); }

  /// Gradient of Q [1/m]; it points inwards.
  Vec3d gradient(const Vec3d& p) const { return m_frame.gradient(m_local.gradient(m_frame.local_point(p))); }

  /// Q about the centre of a box.
  QuadricInBox in(const Box3d& box) const { return about(box.min * 0.5 + box.max * 0.5, box); }

  /// Q about another point of a box.
  QuadricInBox about(const Vec3d& point, const Box3d& box) const;

  /// Bounds of Q over a box, rounding included; without cross terms no wider than rounding demands.
  Interval range(const Box3d& box) const { return in(box).range(); }

  /// A box around the part of {Q >= -level} in `clip`, which may be infinite as may be the result; to
  /// rounding. Empty where nothing is.
  Box3d bounds(double level, const Box3d& clip) const;

  /// The quadric after space has been moved by a map.
  Quadric moved(const Affine& map) const { return Quadric(m_frame.moved(map), m_local); }

  /// The quadric for those who see space in local coordinates of a frame.
  Quadric relative_to(const Frame& frame) const { return Quadric(m_frame.relative_to(frame), m_local); }

  const Frame& frame() const { return m_frame; }
  const QuadricCoefficients& coefficients() const { return m_local; }

 private:
  Frame m_frame;
  QuadricCoefficients m_local;   ///< in the frame's coordinates
  QuadricCoefficients m_second;  ///< the second-order terms for offsets along the axes of space; others 0
};

/// The whole of space as a box.
Box3d everywhere();

}  // namespace pileus
