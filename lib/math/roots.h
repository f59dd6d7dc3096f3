#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <optional>

#include <ImathVec.h>

#include "lib/math/two_product.h"

namespace pileus {

/// Up to two real roots, ascending.
template <std::floating_point T>
struct Roots {
  int count = 0;
  std::array<T, 2> t{};

  const T* begin() const { return t.data(); }
  const T* end() const { return t.data() + count; }

  /// The smallest root in the open interval (t0, t1).
  std::optional<T> first_in(T t0, T t1) const {
    for (const T root : *this) {
      if (root > t0 && root < t1) return root;
    }
    return std::nullopt;
  }
};

namespace detail {

/// m * 2^e with 1/2 <= |m| < 1; zero has an exponent below all others.
template <std::floating_point T>
struct Scaled {
  T m;
  int e = -1'000'000;

  explicit Scaled(T x) : m(x) {
    if (x != 0) m = std::frexp(x, &e);
  }
};

template <std::floating_point T>
Roots<T> ascending(T a, T b) {
  return {2, {std::min(a, b), std::max(a, b)}};
}

}  // namespace detail

/// Real roots of a t^2 + b t + c, to 3 ulp however close together or far apart they lie; a double root counts
/// twice. With a = 0 the one root of the line; with a = b = 0, or where a coefficient is not finite, none
/// (the sign of c says on which side the whole line lies). A root beyond the largest number is infinite.
///
/// The discriminant is formed from exact products of the mantissas, so that neither the rounding of a c nor
/// an overflow of b^2 reaches the roots; exponents are put back at the end.
///
/// ref: METHODS 5.8; Kahan 2004, On the cost of floating-point computation without extra-precise arithmetic
template <std::floating_point T>
Roots<T> quadratic_roots(T a, T b, T c) {
  if (!std::isfinite(a) || !std::isfinite(b) || !std::isfinite(c)) return {};
  if (a == 0) return b == 0 ? Roots<T>{} : Roots<T>{1, {-c / b, 0}};

  const detail::Scaled<T> sa(a), sb(b), sc(c);
  const int half_b_e = sb.e - 1;

  // D = (b/2)^2 - a c, in units of 2^e with e even, e so that the larger term is about 1.
  int e = std::max(2 * half_b_e, sa.e + sc.e);
  e += e & 1;
  const TwoProduct<T> bb = two_product(sb.m, sb.m);
  const TwoProduct<T> ac = two_product(sa.m, sc.m);
  const auto bb_scaled = [&](T x) { return std::ldexp(x, 2 * half_b_e - e); };
  const auto ac_scaled = [&](T x) { return std::ldexp(x, sa.e + sc.e - e); };
  const T discriminant =
      (bb_scaled(bb.value) - ac_scaled(ac.value)) + (bb_scaled(bb.error) - ac_scaled(ac.error));
  if (discriminant < 0) return {};

  // q = -(b/2 + sign(b) sqrt(D)), in units of 2^(e/2), adds magnitudes; the roots are q / a and c / q.
  const T half_b = std::ldexp(sb.m, half_b_e - e / 2);
  const T q = -(half_b + std::copysign(std::sqrt(discriminant), half_b));
  if (q == 0) return {2, {0, 0}};
  return detail::ascending(std::ldexp(q / sa.m, e / 2 - sa.e), std::ldexp(sc.m / q, sc.e - e / 2));
}

/// Both parameters t at which o + t d meets a sphere, in units of f: for |d| = 1 distances, < 0 behind o.
/// To 4 ulp of the larger of |t|, both for small far spheres and for planets under the eye.
///
/// ref:      METHODS 5.8; far regime: Haines, Guenther, Akenine-Moeller 2019
/// params:   f = o - centre, subtracted in double where either is large; |d| = 1; radius >= 0
/// returns:  none where the line misses, or where a value is not finite or its square overflows
template <std::floating_point T>
Roots<T> sphere_hits(const Imath::Vec3<T>& f, const Imath::Vec3<T>& d, T radius) {
  const T b = -(f.dot(d));             // parameter of the point nearest to the centre
  const Imath::Vec3<T> l = f + b * d;  // from the centre to that point
  const T n = f.length();
  const T c = (n - radius) * (n + radius);
  if (!std::isfinite(c)) return {};
  const T l2 = l.dot(l);
  const T r2 = radius * radius;

  // Of two equal discriminants, the one with the smaller terms loses less.
  const bool is_far_or_small = b * b + std::abs(c) >= r2 + l2;
  const T discriminant = is_far_or_small ? r2 - l2 : b * b - c;
  if (!(discriminant >= 0)) return {};

  const T q = b + std::copysign(std::sqrt(discriminant), b);
  if (q == 0) return {2, {0, 0}};
  return detail::ascending(c / q, q);
}

}  // namespace pileus
