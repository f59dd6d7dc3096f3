#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>

namespace pileus {

// Classical fade factors: what is seen at a distance is F * its colour + (1 - F) * the fog's. Only the
// exponential law is that of a medium, F(a + b) = F(a) F(b); the others depend on the observer. Distances are
// >= 0 and may be infinite; densities are >= 0. ref: METHODS 2.1 (the printed forms have lost the
// exponential)

/// Falls from 1 at `start` to 0 at `end`; a step where they are the same, 0 at it.
template <std::floating_point T>
T linear_fade(T distance, T start, T end) {
  if (distance >= end) return 0;
  if (distance <= start) return 1;
  return std::clamp((end - distance) / (end - start), T(0), T(1));
}

/// exp(-density * distance); no fog wins over infinite distance.
template <std::floating_point T>
T exponential_fade(T distance, T density) {
  return density > 0 && distance > 0 ? std::exp(-density * distance) : T(1);
}

/// exp(-(density * distance)^2): exactly 0 where the square overflows.
template <std::floating_point T>
T exponential_squared_fade(T distance, T density) {
  if (!(density > 0 && distance > 0)) return 1;
  const T x = density * distance;
  return std::exp(-x * x);
}

}  // namespace pileus
