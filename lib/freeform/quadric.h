#pragma once

#include "lib/math/vec.h"

namespace pileus {

/// F = a11 x² + a22 y² + a33 z² + a12 xy + a13 xz + a23 yz + a14 x + a24 y + a34 z + a44, inside where F >=
/// 0. Cross terms are not doubled (METHODS §4.1). x, y, z are local coordinates, (p - center) / size per
/// axis: a solid far from the origin then loses no digits. Unchanged coefficients make the unit ball, hence
/// the ellipsoid of radii `size`: F = 1 - |local|², 1 at the centre and 0 on the surface.
struct Quadric {
  Vec3d center{0.0, 0.0, 0.0};  ///< [m]
  Vec3d size{1.0, 1.0, 1.0};    ///< [m], > 0
  double a11 = -1.0, a22 = -1.0, a33 = -1.0;
  double a12 = 0.0, a13 = 0.0, a23 = 0.0;
  double a14 = 0.0, a24 = 0.0, a34 = 0.0;
  double a44 = 1.0;

  /// F at a point of world space [1].
  double value(const Vec3d& p_world) const;

  /// Gradient of F in world space [1/m]; it points inwards.
  Vec3d gradient(const Vec3d& p_world) const;

  /// Upper bound of F over a box of world space; the maximum itself, up to rounding, where no cross terms
  /// are.
  double upper_bound(const Box3d& box_world) const;

  Vec3d local_from_world(const Vec3d& p_world) const { return (p_world - center) / size; }
};

Quadric ellipsoid(const Vec3d& center, const Vec3d& radii);

}  // namespace pileus
