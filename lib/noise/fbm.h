#pragma once

#include "lib/math/vec.h"
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
///   value(p)  = sum gain^i n(p_i)   / sum gain^i,  |value| <= kPerlinBound
///   billow(p) = sum gain^i |n(p_i)| / sum gain^i,  0 <= billow <= kPerlinBound
/// with p_i = frequency lacunarity^i p + i * (a fixed shift). Without the shift all octaves would be 0 at the
/// origin together. Billows are round where |n| is large and creased where n = 0, like a cauliflower.
/// threads: const, safe from many threads
class Fbm {
 public:
  /// params: octaves >= 1, the rest finite, gain > 0 (describing tables check that)
  explicit Fbm(const FbmParams& params);

  /// p_world [m], finite.
  double value(const Vec3d& p_world) const;
  double billow(const Vec3d& p_world) const;

 private:
  FbmParams m_params;
  PerlinNoise m_noise;
  double m_normalization;  ///< 1 / sum of the amplitudes
};

}  // namespace pileus
