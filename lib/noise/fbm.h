#pragma once

#include <span>
#include <vector>

#include "lib/math/interval.h"
#include "lib/math/vec.h"
#include "lib/noise/noise_block.h"
#include "lib/noise/octave_sum.h"
#include "lib/noise/perlin.h"

namespace pileus {

/// An octave sum: octave i has the frequency `frequency * lacunarity^i` and the amplitude `gain^i`.
struct FbmParams {
  int octaves = 6;
  double frequency = 1.0;  ///< of the first octave [1/m]
  double lacunarity = 2.0;
  double gain = 0.5;
  int seed = 0;  ///< of PerlinNoise
};

/// Fractal noise: octaves of PerlinNoise, divided by the sum of their amplitudes, so that every octave sum
/// keeps the bound of a single octave:
///   sum gain^i shape(n(p_i)) / sum gain^i,  shape as OctaveSum tells
///   fbm: |value| <= kPerlinBound;  billow: 0 <= value <= kPerlinBound;  ridged: 0 <= value <= 1
/// with p_i = frequency lacunarity^i p + i * (a fixed shift). Without the shift all octaves would be 0 at the
/// origin together.
/// threads: const, safe from many threads
class Fbm {
 public:
  /// params: octaves >= 1, the rest finite, gain > 0 (describing tables check that)
  explicit Fbm(const FbmParams& params);

  /// p_world [m], finite.
  double value(OctaveSum kind, const Vec3d& p_world) const;

  /// The same at all points of a block [m], in single precision: within kNoiseFloatError of value(), also far
  /// from the origin. Tens of times as fast; fastest with at least eight points along z.
  ///   values: block.size(), as NoiseBlock lays them out
  void evaluate(OctaveSum kind, const NoiseBlock& block, std::span<float> values) const;

  /// Bounds of value() and evaluate() in a box [m]: certain, and tight where the box is small against the
  /// cells of the octaves that matter.
  Interval bound(OctaveSum kind, const Box3d& box_world) const;

 private:
  PerlinNoise m_noise;
  std::vector<NoiseOctave> m_octaves;  ///< the sum of their amplitudes is 1
};

/// How far the single-precision functions are off, at most.
inline constexpr double kNoiseFloatError = 4e-6;

}  // namespace pileus
