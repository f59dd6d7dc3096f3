#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>

namespace pileus {

// Opacity, transmittance and source weights of a segment, in forms that neither cancel nor overflow (METHODS
// 1, 2.2). Templates over float and double; the errors stated hold in both, u being the unit roundoff of the
// format. Arguments are not checked (hot path): optical depths and lengths are >= 0 and may be +inf.

/// exp(-tau) [1]: 1 at 0, exactly 0 at +inf.
template <std::floating_point T>
T transmittance(T tau) {
  return std::exp(-tau);
}

/// 1 - exp(-tau) [1], to 2 ulp however small: 0 at 0, exactly 1 at +inf.
template <std::floating_point T>
T opacity_from_tau(T tau) {
  return -std::expm1(-tau);
}

/// Opacity [1] of a path of `length` units through a medium with the opacity `omega` per unit of length:
/// 1 - (1 - omega)^length, to 2 ulp. Clear (omega <= 0) stays clear over any length; opaque (omega >= 1) is
/// opaque over any length > 0.
template <std::floating_point T>
T opacity(T omega, T length) {
  if (omega <= 0) return 0;
  if (omega >= 1) return length > 0 ? T(1) : T(0);
  return -std::expm1(length * std::log1p(-omega));
}

/// Extinction [1/unit] of a medium with the opacity `omega` per unit of length: -ln(1 - omega); +inf for an
/// opaque one.
template <std::floating_point T>
T extinction_from_opacity(T omega) {
  if (omega <= 0) return 0;
  if (omega >= 1) return std::numeric_limits<T>::infinity();
  return -std::log1p(-omega);
}

/// Mean transmittance over a segment of constant extinction, (1 - exp(-tau)) / tau [1]: 1 at 0, 0 at +inf.
template <std::floating_point T>
T phi1(T tau) {
  return tau > 0 ? -std::expm1(-tau) / tau : T(1);
}

/// What the two ends of a segment contribute to its radiance, where the source is linear in optical depth
/// between them: L = front * L_front + back * L_back. Their sum is the segment's opacity.
template <std::floating_point T>
struct SourceWeights {
  T front = 0;
  T back = 0;
};

namespace detail {

/// Factors of the alternating power series of the source weights (METHODS 2.2), divided by tau:
/// front / tau = sum_k (-tau)^k / (k + 2)!,  back / tau = sum_k (k + 1) (-tau)^k / (k + 2)!
template <std::floating_point T>
struct SourceSeries {
  static constexpr size_t kTerms = std::numeric_limits<T>::digits <= 24 ? 14 : 23;
  std::array<T, kTerms> front{}, back{};

  constexpr SourceSeries() {
    long double factorial = 1;  // (k + 2)!
    for (size_t k = 0; k < kTerms; ++k) {
      factorial *= static_cast<long double>(k + 2);
      front[k] = static_cast<T>(1 / factorial);
      back[k] = static_cast<T>(static_cast<long double>(k + 1) / factorial);
    }
  }
};

template <std::floating_point T>
inline constexpr SourceSeries<T> kSourceSeries;

}  // namespace detail

/// Weights of a segment of optical depth tau: front = 1 - phi1(tau), back = phi1(tau) - exp(-tau), to 4 ulp.
/// Below tau = 1.5 both differences cancel and a series takes over. tau = +inf gives {1, 0}.
/// ref: METHODS 2.2
template <std::floating_point T>
SourceWeights<T> source_weights(T tau) {
  if (tau >= T(1.5)) {
    const T mean = phi1(tau);
    return {T(1) - mean, mean - transmittance(tau)};
  }
  const auto& series = detail::kSourceSeries<T>;
  SourceWeights<T> sum;
  for (size_t k = series.kTerms; k-- > 0;) {
    sum.front = series.front[k] - tau * sum.front;
    sum.back = series.back[k] - tau * sum.back;
  }
  return {tau * sum.front, tau * sum.back};
}

}  // namespace pileus
