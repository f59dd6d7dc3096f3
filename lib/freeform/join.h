#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>

namespace pileus {

enum class Join : int { unite, intersect, subtract };

/// How two functions a and b become one where solids are joined:
///   union         (a + b + sqrt(a² + b² - 2 alpha a b + smooth²)) / (1 + alpha)
///   intersection  (a + b - sqrt(a² + b² - 2 alpha a b + smooth²)) / (1 + alpha)
/// alpha = 1 and smooth = 0 give the maximum and the minimum, alpha = 0 Rvachev's functions. smooth > 0
/// rounds the edge where both are 0; a rounded union is larger than the sharp one by smooth / 2 at most where
/// alpha = 1, an intersection smaller.
/// ref: METHODS 4.5; Rvachev 1982; Pasko et al. 1995
struct Blend {
  double smooth = 0.0;  ///< in units of the functions, >= 0
  double alpha = 1.0;   ///< 0 .. 1

  bool is_sharp() const { return smooth == 0.0 && alpha == 1.0; }
};

namespace detail {

/// a² + b² - 2 alpha a b + w², as terms that cannot cancel; a, b and w at most about 1.
template <std::floating_point T>
T blend_square(T a, T b, T alpha, T w) {
  return alpha * (a - b) * (a - b) + (1 - alpha) * (a * a + b * b) + w * w;
}

}  // namespace detail

/// The blended intersection, with full relative accuracy where a + b cancels against the root (METHODS 4.5);
/// no square overflows or vanishes.
template <std::floating_point T>
T intersection(T a, T b, const Blend& blend = {}) {
  if (blend.is_sharp()) return std::min(a, b);
  const T alpha = T(blend.alpha);
  const T scale = std::max({std::fabs(a), std::fabs(b), T(blend.smooth)});
  if (scale == 0) return 0;
  const T x = a / scale, y = b / scale, w = T(blend.smooth) / scale;
  const T root = std::sqrt(detail::blend_square(x, y, alpha, w));
  const T sum = x + y;
  const T twice = sum > 0 ? (2 * (1 + alpha) * x * y - w * w) / (sum + root) : sum - root;
  return scale * twice / (1 + alpha);
}

template <std::floating_point T>
T join(Join kind, T a, T b, const Blend& blend) {
  if (kind == Join::unite) return -intersection(-a, -b, blend);
  return intersection(a, kind == Join::subtract ? -b : b, blend);
}

/// Derivatives of the blended intersection.
struct JoinSlopes {
  double a = 0.0, b = 0.0;
};

/// Undefined where a = b = 0 or, sharp, a = b: the gradient of the smaller of the two then, of a if neither
/// is.
inline JoinSlopes intersection_slopes(double a, double b, const Blend& blend) {
  const double scale = std::max({std::fabs(a), std::fabs(b), blend.smooth});
  if (blend.is_sharp() || scale == 0) return a <= b ? JoinSlopes{1, 0} : JoinSlopes{0, 1};
  const double x = a / scale, y = b / scale, w = blend.smooth / scale, alpha = blend.alpha;
  const double square = detail::blend_square(x, y, alpha, w);
  if (square == 0) return std::fabs(a) <= std::fabs(b) ? JoinSlopes{1, 0} : JoinSlopes{0, 1};
  const double root = std::sqrt(square);
  // 1 - u / root, where root² = u² + rest: without cancellation, as a slope of 0 may meet a huge gradient.
  const auto slope = [&](double of, double other) {
    const double u = of - alpha * other, rest = (1 - alpha) * (1 + alpha) * other * other + w * w;
    return (u > 0 ? rest / (root * (root + u)) : (root - u) / root) / (1 + alpha);
  };
  return {slope(x, y), slope(y, x)};
}

inline JoinSlopes join_slopes(Join kind, double a, double b, const Blend& blend) {
  if (kind == Join::unite) return intersection_slopes(-a, -b, blend);
  if (kind == Join::intersect) return intersection_slopes(a, b, blend);
  const JoinSlopes slopes = intersection_slopes(a, -b, blend);
  return {slopes.a, -slopes.b};
}

}  // namespace pileus
