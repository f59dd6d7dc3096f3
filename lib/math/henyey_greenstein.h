#pragma once

#include <cmath>
#include <concepts>
#include <numbers>

namespace pileus {

// The phase function of Henyey and Greenstein for every |g| < 1, without a clamp and without the cancelling
// textbook denominator 1 + g^2 - 2 g cos. The scattering angle enters as 1 - cos and 1 + cos, each with its
// full relative accuracy: for unit vectors wo and wi that leave the point, 1 - cos = |wo + wi|^2 / 2 (0
// straight on) and 1 + cos = |wo - wi|^2 / 2.

/// p(theta) [1/sr] to 5 ulp, for g in (-1, 1). Its integral over the sphere is 1, its mean cosine g.
/// ref: henyey1941; METHODS 3.2
template <std::floating_point T>
T henyey_greenstein(T g, T one_minus_cos, T one_plus_cos) {
  constexpr T kInv4Pi = std::numbers::inv_pi_v<T> / 4;
  const T a = std::abs(g);
  const T e = 1 - a;  // exact for |g| >= 1/2
  const T x = g >= 0 ? one_minus_cos : one_plus_cos;
  const T d = e * e + 2 * a * x;
  return kInv4Pi * (e * (1 + a)) / (d * std::sqrt(d));
}

/// A scattering angle drawn from the phase function. Build directions from these, not from acos.
template <std::floating_point T>
struct ScatteringAngle {
  T one_minus_cos = 0;
  T one_plus_cos = 0;
  T pdf = 0;  ///< [1/sr]: the phase function's value

  T sin() const { return std::sqrt(one_minus_cos * one_plus_cos); }
  T cos() const { return one_minus_cos < one_plus_cos ? 1 - one_minus_cos : one_plus_cos - 1; }
};

/// Inverts the cumulative distribution of cos: xi = 0 is straight back, xi -> 1 straight on. 1 -+ cos to 6
/// ulp, for g in (-1, 1) and xi in [0, 1).
/// ref: METHODS 3.3
template <std::floating_point T>
ScatteringAngle<T> sample_henyey_greenstein(T g, T xi) {
  constexpr T kInv4Pi = std::numbers::inv_pi_v<T> / 4;
  // A lobe with g < 0 is the lobe of |g| seen in the mirror: exchange xi with 1 - xi, and the results.
  const bool is_forward = g >= 0;
  const T a = std::abs(g);
  const T near = is_forward ? xi : 1 - xi;
  const T far = is_forward ? 1 - xi : xi;

  // Every bracket is a sum of terms >= 0.
  const T e = 1 - a;
  const T d = e + 2 * a * near;
  const T off_peak = e / d;
  const T off_tail = (1 + a) / d;
  const T from_peak = 2 * off_peak * off_peak * far * (1 + a * near);
  const T from_tail = 2 * off_tail * off_tail * near * (e + a * near);
  const T pdf = kInv4Pi / (off_peak * off_peak * off_tail * off_tail * d);
  return is_forward ? ScatteringAngle<T>{from_peak, from_tail, pdf}
                    : ScatteringAngle<T>{from_tail, from_peak, pdf};
}

}  // namespace pileus
