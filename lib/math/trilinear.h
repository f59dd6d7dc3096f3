#pragma once

#include <array>

#include <ImathVec.h>

#include "lib/math/lerp.h"

namespace pileus {

/// The trilinear interpolation of a cell's corners at p in [0, 1]^3.
///   corners[x + 2 * y + 4 * z] with x, y, z in {0, 1}
template <class T>
constexpr T trilinear(const std::array<T, 8>& corners, const Imath::Vec3<T>& p) {
  const T near = lerp(lerp(corners[0], corners[1], p.x), lerp(corners[2], corners[3], p.x), p.y);
  const T far = lerp(lerp(corners[4], corners[5], p.x), lerp(corners[6], corners[7], p.x), p.y);
  return lerp(near, far, p.z);
}

/// The density along a straight segment of a trilinear cell: exactly a cubic, here as its four Bernstein
/// control values b0 .. b3 from entry p to exit q.
///
/// The control values come from the cell's polar form f(r; s; t), its value with x taken from r, y from s and
/// z from t: b0 = f(p;p;p), b1 is the mean of the three values that take one coordinate from q, b2 of those
/// that take two, and b3 = f(q;q;q). All are convex combinations of the corners: where those are >= 0 nothing
/// cancels, the relative error of each value is at most 12 u, and they bound the cubic on the segment.
/// ref:     METHODS 9.1; polar forms: Farouki, Rajan 1987
/// params:  corners[x + 2 * y + 4 * z] with x, y, z in {0, 1}, finite; p, q in [0, 1]^3, cell coordinates;
///          not checked (hot path)
/// returns: b0 .. b3; the integral over a segment of length h is h * bernstein_mean(b)
template <class T>
constexpr std::array<T, 4> trilinear_bernstein(const std::array<T, 8>& corners, const Imath::Vec3<T>& p,
                                               const Imath::Vec3<T>& q) {
  // Along x: the four edges that run along x, at p.x and at q.x, indexed by y + 2 z.
  std::array<T, 4> at_p, at_q;
  for (size_t edge = 0; edge < 4; ++edge) {
    at_p[edge] = lerp(corners[2 * edge], corners[2 * edge + 1], p.x);
    at_q[edge] = lerp(corners[2 * edge], corners[2 * edge + 1], q.x);
  }
  // Along y, on the faces z = 0 and z = 1: no coordinate from q, the sum of the two with one, and both.
  std::array<T, 2> none, one, both;
  for (size_t face = 0; face < 2; ++face) {
    none[face] = lerp(at_p[2 * face], at_p[2 * face + 1], p.y);
    one[face] = lerp(at_q[2 * face], at_q[2 * face + 1], p.y) + lerp(at_p[2 * face], at_p[2 * face + 1], q.y);
    both[face] = lerp(at_q[2 * face], at_q[2 * face + 1], q.y);
  }
  // Along z.
  return {lerp(none[0], none[1], p.z), (lerp(none[0], none[1], q.z) + lerp(one[0], one[1], p.z)) / T(3),
          (lerp(one[0], one[1], q.z) + lerp(both[0], both[1], p.z)) / T(3), lerp(both[0], both[1], q.z)};
}

/// Mean over the segment of a cubic in Bernstein form: the mean of its control values.
template <class T>
constexpr T bernstein_mean(const std::array<T, 4>& b) {
  return ((b[0] + b[1]) + (b[2] + b[3])) / T(4);
}

}  // namespace pileus
