#pragma once

#include "lib/math/vec.h"

namespace pileus {

// The cosine of the scattering angle for wo and wi as a PhaseFunction gets them: unit vectors that both leave
// the point, so light that goes straight on has wi = -wo. As distances from the two ends of the range, which
// keep their digits near the peaks (METHODS 3.2). Rounding may carry them past 2 by an ulp, never below 0.

/// 1 - cos(theta): 0 straight on, 2 straight back.
inline double one_minus_cos(const Vec3d& wo, const Vec3d& wi) {
  const Vec3d sum = wo + wi;
  return 0.5 * dot(sum, sum);
}

/// 1 + cos(theta): 2 straight on, 0 straight back.
inline double one_plus_cos(const Vec3d& wo, const Vec3d& wi) {
  const Vec3d difference = wo - wi;
  return 0.5 * dot(difference, difference);
}

}  // namespace pileus
