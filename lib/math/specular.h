#pragma once

#include <cmath>
#include <concepts>

namespace pileus {

/// Specular power (1 - delta)^n of a highlight, to 4 ulp. With delta = |R - V|^2 / 2 for unit vectors R and
/// V, 1 - delta is their cosine, but keeps the digits that a rounded cosine near 1 has lost and n would
/// multiply. Zero from 90 degrees (delta >= 1) on.
/// ref: METHODS 12
template <std::floating_point T>
T specular_power(T delta, T n) {
  return delta < 1 ? std::exp(n * std::log1p(-delta)) : T(0);
}

}  // namespace pileus
