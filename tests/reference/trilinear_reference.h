#pragma once

#include <array>

#include <ImathVec.h>

namespace pileus::reference {

/// Trilinear interpolation as the sum of its eight products; corners[x + 2 * y + 4 * z].
template <class T>
long double trilinear(const std::array<T, 8>& corners, long double x, long double y, long double z) {
  long double sum = 0;
  for (int i = 0; i < 8; ++i) {
    sum += corners[size_t(i)] * (i & 1 ? x : 1 - x) * (i & 2 ? y : 1 - y) * (i & 4 ? z : 1 - z);
  }
  return sum;
}

/// Mean along a straight segment, by the two-point rule of Gauss, exact for cubics.
template <class T>
long double trilinear_mean(const std::array<T, 8>& corners, const Imath::Vec3<T>& p,
                           const Imath::Vec3<T>& q) {
  long double mean = 0;
  for (const long double t : {0.211324865405187117745425609749021L, 0.788675134594812882254574390250979L}) {
    const auto at = [t](long double a, long double b) { return a + t * (b - a); };
    mean += 0.5L * trilinear(corners, at(p.x, q.x), at(p.y, q.y), at(p.z, q.z));
  }
  return mean;
}

}  // namespace pileus::reference
