#pragma once

namespace pileus {

/// Linear interpolation: a at t = 0 and b at t = 1, both exactly, for finite a and b.
///   (1 - t) a + t b
/// Written as a sum of products so that nothing cancels where a and b have one sign: there the relative error
/// is at most 3 u, and the result leaves [a, b] by no more than that. The fused form fma(t, b, fma(-t, a, a))
/// would save a rounding, but costs two library calls on a machine without hardware FMA.
/// params:  t in [0, 1]; not checked (hot path)
template <class T>
constexpr T lerp(T a, T b, T t) {
  return a * (T(1) - t) + b * t;
}

}  // namespace pileus
