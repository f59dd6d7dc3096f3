#pragma once

#include <array>
#include <cstdint>

#include "lib/math/interval.h"
#include "lib/math/vec.h"
#include "lib/noise/kernels/noise_kernel.h"

namespace pileus {

/// Least upper bound of |noise| over every assignment of gradients to a cell's corners, rounded up (it is
/// 1.03635…, reached off the cell's centre). The often quoted 1 is too small.
inline constexpr double kPerlinBound = 1.037;

/// Upper bounds, over all places and assignments of gradients, of what the noise does per lattice unit;
/// proved by subdivision in tests/lib/perlin_bound_test.cpp. n_k is the derivative along axis k, h the half
/// edge of a cube; sums run over the axes.
inline constexpr double kPerlinSlope = 3.8;           ///< |n_k|; 3.75 in the middle of a cell
inline constexpr double kPerlinCubeSlope = 5.45;      ///< sum |n_k|: n differs by at most this times h
inline constexpr double kPerlinCubeCurvature = 44.5;  ///< |sum n_kl d_k d_l| for |d_k| <= 1

/// Noise and its derivatives along x, y and z.
struct NoiseSample {
  double value;
  Vec3d gradient;
};

/// Improved gradient noise: a smooth pseudo-random function of space with features about 1 unit across, C2,
/// mean 0, |value| <= kPerlinBound, 0 at every point of the integer lattice, with period 256 along each axis.
/// ref:     perlin2002 (12 edge gradients, fade 6t^5 - 15t^4 + 10t^3, the published permutation)
/// threads: const, safe from many threads
class PerlinNoise {
 public:
  /// Seed 0 is the published permutation. Any other seed is a Fisher-Yates shuffle of it, driven by
  /// SplitMix64: the same on every machine.
  explicit PerlinNoise(uint64_t seed = 0);

  /// p in lattice units; any finite coordinates. Beyond 2^52 units all points are lattice points.
  double value(const Vec3d& p) const;
  NoiseSample sample(const Vec3d& p) const;

  /// What the noise can be in a box (lattice units): certain, to within kNoiseMargin on either side. Tight to
  /// second order in the size of small boxes; large ones get +-kPerlinBound.
  Interval bound(const Box3d& box) const;

  /// What the kernels read.
  const NoiseTables& tables() const { return m_tables; }

 private:
  std::array<uint8_t, 256> m_permutation;
  NoiseTables m_tables;
};

/// Bounds are wider than those of real numbers by this much, which covers the rounding of single precision
/// (lib/noise/fbm.h) and their own.
inline constexpr double kNoiseMargin = 1e-5;

}  // namespace pileus
