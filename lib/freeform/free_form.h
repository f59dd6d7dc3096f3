#pragma once

#include "lib/freeform/quadric.h"
#include "lib/math/vec.h"

namespace pileus {

class ParamTable;

/// A solid given by a function of space: inside is f(p) >= 0. `[freeform.NAME]` of a scene:
///   base = { ellipsoid = { center = [0, 1, 0], radii = [3, 1, 2] } }
/// f is normalised by its base: 1 at the centre of the ellipsoid, 0 on its surface.
/// ref:     vyatkin2013
/// threads: const calls are safe from many threads
struct FreeForm {
  Quadric base;

  void describe(ParamTable& params);

  /// f at a point of world space [1].
  double value(const Vec3d& p_world) const;

  /// Gradient of f [1/m]; it points inwards.
  Vec3d gradient(const Vec3d& p_world) const;

  /// Upper bound of f over a box of world space, rounding included: below 0, the box is outside.
  double upper_bound(const Box3d& box_world) const;

  /// World-space box that holds the solid [m].
  Box3d bounds() const;
};

}  // namespace pileus
