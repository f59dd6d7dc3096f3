#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "lib/math/vec.h"
#include "lib/noise/noise_block.h"
#include "lib/noise/octave_sum.h"

namespace pileus {

/// The permutation of PerlinNoise as the kernels read it.
struct NoiseTables {
  /// hash[n] = permutation[n mod 256]: sums of a hash and a lattice coordinate need no wrapping.
  std::array<uint8_t, 512> hash;
  /// The gradient's number, 0 to 15, at the end of the chain of hashes: gradient[n] = permutation[n mod 256]
  /// mod 16. Long enough to read the gradients of a whole row of lattice points at once.
  std::array<uint8_t, 768> gradient;
};

/// One octave of an octave sum.
struct NoiseOctave {
  double frequency;  ///< [1/m]
  Vec3d shift;       ///< [lattice units]; the noise is read at frequency * p + shift
  double amplitude;  ///< > 0
};

/// sum over the octaves of amplitude * shape(noise), for all points of a block; values as NoiseBlock lays
/// out. Cost, in instructions of AVX2 per point and octave, on points h lattice units apart: see
/// docs/noise.md.
void sum_octaves(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                 const NoiseBlock& block, std::span<float> values);

/// Name of the instruction set in use.
const char* noise_target();

}  // namespace pileus
