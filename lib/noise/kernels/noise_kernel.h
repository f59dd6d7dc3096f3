#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "lib/math/vec.h"
#include "lib/noise/noise_block.h"
#include "lib/noise/octave_sum.h"

namespace pileus {

/// Corners of the hexagon that a gradient walks around in one turn (PerlinNoise).
inline constexpr int kTurnSteps = 6;

/// The permutation of PerlinNoise as the kernels read it. Indices are sums of a hash and a lattice
/// coordinate, both 0 .. 255, that need no wrapping: entry n is that of n mod 256.
struct NoiseTables {
  std::array<uint8_t, 512> hash;
  /// Numbers, 0 to 15, of the gradients at the end of the chain of hashes, after each step of a turn. Long
  /// enough to read those of a whole row of lattice points at once.
  std::array<std::array<uint8_t, 768>, kTurnSteps> gradient;
  /// The same for gathers, which read 32 bits: hash n in the lowest byte, hash n + 1 in the next; the number
  /// of gradient n in the highest byte, that of n + 1 in the second lowest.
  std::array<int32_t, 512> hash_pair;
  std::array<std::array<int32_t, 512>, kTurnSteps> gradient_pair;
};

/// How far gradients have turned: from + share * (to - from), the first two steps of a turn.
struct NoiseTurn {
  int from = 0, to = 1;
  float share = 0;  ///< 0 .. 1
};

/// How noise departs from the published one.
struct NoiseVariant {
  Vec3i period = Vec3i(0);  ///< lattice units after which it repeats along each axis; 0: the published 256
  NoiseTurn turn = {};
};

/// One octave of an octave sum.
struct NoiseOctave {
  double frequency;  ///< [1/m]
  Vec3d shift;       ///< [lattice units]; the noise is read at frequency * p + shift
  double amplitude;  ///< > 0
  NoiseVariant variant = {};
};

// sum over the octaves of amplitude * shape(noise): values and, where not empty, gradients in world space
// [1/m]. Arrays over a block as NoiseBlock lays them out. What they cost: docs/noise.md.

void sum_octaves(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                 const NoiseBlock& block, std::span<float> values, std::span<Vec3f> gradients);
void sum_octaves(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                 std::span<const Vec3d> points, std::span<float> values, std::span<Vec3f> gradients);

/// Bounds of the sums in cubes around the points of a block, edges as long as the spacing; without the margin
/// for single precision.
void bound_octaves(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                   const NoiseBlock& centres, std::span<float> lo, std::span<float> hi);

/// Name of the instruction set in use.
const char* noise_target();

}  // namespace pileus
