#pragma once

#include "lib/math/vec.h"

namespace pileus {

/// Which points of some a shape keeps the sun from.
enum class Shade { none, all, unknown };

/// A shape that can prove where its shadow lies.
struct KnownShadow {
  virtual ~KnownShadow() = default;

  /// Of the points between p0 and p1. What is not `unknown` is proven, rounding included.
  ///   towards_sun: unit vector
  ///   off: [m] the points may lie as far from where they are said to be
  virtual Shade shade_between(const Vec3d& p0, const Vec3d& p1, const Vec3d& towards_sun,
                              double off) const = 0;
};

}  // namespace pileus
