#pragma once

#include <array>
#include <cstdint>

#include "lib/math/vec.h"
#include "lib/noise/kernels/noise_kernel.h"
#include "lib/noise/perlin_bounds.h"

namespace pileus {

/// Noise and its derivatives along x, y and z.
struct NoiseSample {
  double value;
  Vec3d gradient;
};

/// Improved gradient noise: a smooth pseudo-random function of space with features about 1 unit across, C2,
/// mean 0, |value| <= kPerlinBound, 0 at every point of the integer lattice, with period 256 along each axis.
/// Flow: each lattice point's gradient walks around one of the two hexagons of gradients that it lies on,
/// either way, along the edges at even speed. So it stays in the hull of the twelve: bounds hold at any time.
/// ref:     perlin2002 (12 edge gradients, fade 6t^5 - 15t^4 + 10t^3, the published permutation)
///          perlin2001 (flow noise: gradients that turn; theirs turn on circles, which leave the hull)
/// threads: const, safe from many threads
class PerlinNoise {
 public:
  /// Seed 0 is the published permutation. Any other seed is a Fisher-Yates shuffle of it, driven by
  /// SplitMix64: the same on every machine.
  explicit PerlinNoise(uint64_t seed = 0);

  /// p in lattice units; any finite coordinates. Beyond 2^52 units all points are lattice points.
  double value(const Vec3d& p, const NoiseVariant& variant = {}) const;
  NoiseSample sample(const Vec3d& p, const NoiseVariant& variant = {}) const;

  /// What the kernels read.
  const NoiseTables& tables() const { return m_tables; }

 private:
  Vec3d gradient(size_t hash, const NoiseTurn& turn) const;

  std::array<uint8_t, 256> m_permutation;
  NoiseTables m_tables;
};

/// Where gradients stand after so many revolutions; the noise at 1 is that at 0, between them it flows in
/// place.
NoiseTurn noise_turn(double revolutions);

}  // namespace pileus
