#pragma once

#include <array>
#include <cstdint>

#include "lib/math/vec.h"

namespace pileus {

/// Least upper bound of |noise| over every assignment of gradients to a cell's corners, rounded up (it is
/// 1.03635…, reached off the cell's centre). The often quoted 1 is too small.
inline constexpr double kPerlinBound = 1.037;

/// Improved gradient noise: a smooth pseudo-random function of space with features about 1 unit across, C2,
/// mean 0, |value| <= kPerlinBound, 0 at every point of the integer lattice, with period 256 along each axis.
/// ref:     perlin2002 (12 edge gradients, fade 6t^5 - 15t^4 + 10t^3, the published permutation)
/// threads: const, safe from many threads
class PerlinNoise {
 public:
  /// Seed 0 is the published permutation. Any other seed is a Fisher-Yates shuffle of it, driven by
  /// SplitMix64: the same on every machine.
  explicit PerlinNoise(uint64_t seed = 0);

  /// p in lattice units; any finite coordinates. Beyond 2^52 (2^23) units all points are lattice points.
  double value(const Vec3d& p) const;

  /// The same in single precision, within 1.5e-5: the fade's terms reach 15 and cancel, along three axes.
  float value(const Vec3f& p) const;

 private:
  std::array<uint8_t, 256> m_permutation;
};

}  // namespace pileus
