#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "lib/math/vec.h"

namespace pileus::reference {

// For coefficients of binary32, whose products are exact in long double: the textbook forms do no harm there.

/// Roots of a t^2 + b t + c with a != 0, ascending.
inline std::vector<long double> quadratic_roots(float a, float b, float c) {
  const long double half_b = 0.5L * b;
  const long double discriminant = half_b * half_b - static_cast<long double>(a) * c;
  if (discriminant < 0) return {};
  const long double q = -(half_b + std::copysign(std::sqrt(discriminant), half_b));
  const long double t0 = q / a, t1 = q == 0 ? 0 : c / q;
  return t0 < t1 ? std::vector{t0, t1} : std::vector{t1, t0};
}

/// The same for |f + t d| = radius, with d of any length but 0.
inline std::vector<long double> sphere_hits(const Imath::V3f& f, const Imath::V3f& d, float radius) {
  const auto dot = [](const Imath::V3f& p, const Imath::V3f& q) {
    return static_cast<long double>(p.x) * q.x + static_cast<long double>(p.y) * q.y +
           static_cast<long double>(p.z) * q.z;
  };
  const long double a = dot(d, d), half_b = dot(f, d),
                    c = dot(f, f) - static_cast<long double>(radius) * radius;
  const long double discriminant = half_b * half_b - a * c;
  if (discriminant < 0) return {};
  const long double root = std::sqrt(discriminant);
  return {(-half_b - root) / a, (-half_b + root) / a};
}

}  // namespace pileus::reference
