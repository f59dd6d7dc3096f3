#pragma once

#include <span>
#include <string>
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
  /// Cells of the first octave after which the noise repeats along x, y and z; 0: never (but every 256 cells
  /// of an octave). tile * lacunarity^i has to be whole for all octaves: check() tells.
  Vec3i tile = Vec3i(0);
  /// Flow in place, for animations [turns of the first octave]; octave i makes about lacunarity^(2/3 i) turns
  /// in that time, as eddies do, rounded: whole numbers give the noise of 0 again.
  double evolution = 0.0;
  /// Domain warp: how far the noise displaces the points it is read at, in cells of the first octave; >= 0.
  double warp = 0.0;

  /// Appends a sentence for everything wrong that no single parameter's range can tell.
  void check(std::vector<std::string>& problems) const;
};

/// Bounds are wider than those of real numbers by this much on either side, which covers the rounding of all
/// functions here.
inline constexpr double kNoiseMargin = 2e-5;

/// How far the single-precision functions are off, at most: of values; of gradients, times the sum of
/// amplitude * frequency over the octaves [1/m].
inline constexpr double kNoiseFloatError = 4e-6;
inline constexpr double kNoiseFloatSlopeError = 2e-5;

/// Fractal noise: octaves of PerlinNoise, divided by the sum of their amplitudes, so that every octave sum
/// keeps the bound of a single octave:
///   sum gain^i shape(n(p_i)) / sum gain^i,  shape as OctaveSum tells
///   fbm: |value| <= kPerlinBound;  billow: 0 <= value <= kPerlinBound;  ridged: 0 <= value <= 1
/// with p_i = frequency lacunarity^i q + i * (a fixed shift); without the shift all octaves would be 0 at the
/// origin together. q = p + warp / frequency * (three octave sums of kWarpOctaves octaves, with the
/// frequencies of the first ones, shifted). Formulas, bounds and costs: docs/noise.md.
/// ref:     musgrave2003 (octave sums, ridges, domain warp)
/// threads: const, safe from many threads
class Fbm {
 public:
  static constexpr int kWarpOctaves = 2;

  /// params: octaves >= 1, the rest finite, gain > 0 (describing tables check that), no problems in check()
  explicit Fbm(const FbmParams& params);

  /// Value and gradient [1/m] at a point [m], finite, in double precision. Billows and ridges have creases
  /// where the gradient is that of one side.
  double value(OctaveSum kind, const Vec3d& p_world) const;
  NoiseSample sample(OctaveSum kind, const Vec3d& p_world) const;

  /// The same at all points of a block, in single precision: within kNoiseFloatError of value(), also far
  /// from the origin (with warp: read at points within kNoiseFloatError * warp cells). Tens of times as fast;
  /// fastest with at least eight points along z, and without warp.
  ///   values, gradients: block.size(), as NoiseBlock lays them out
  void evaluate(OctaveSum kind, const NoiseBlock& block, std::span<float> values) const;
  void evaluate(OctaveSum kind, const NoiseBlock& block, std::span<float> values,
                std::span<Vec3f> gradients) const;

  /// The same at any points.
  void evaluate(OctaveSum kind, std::span<const Vec3d> points, std::span<float> values) const;
  void evaluate(OctaveSum kind, std::span<const Vec3d> points, std::span<float> values,
                std::span<Vec3f> gradients) const;

  /// Bounds of value() and evaluate() in a box [m]: certain. The box is cut into cubes, `parts` along its
  /// longest edge; tight where those are small against the cells of the octaves that matter. Costs about as
  /// much as evaluate() with gradients at the centres of the cubes.
  Interval bound(OctaveSum kind, const Box3d& box_world, int parts = 4) const;

  /// Bounds in many cubes at once: cube (i, j, k) has its least corner at point (i, j, k) of the block and
  /// edges as long as the spacing. Without warp, that is much cheaper than to ask one by one.
  ///   bounds: cubes.size(), as NoiseBlock lays them out
  void bound(OctaveSum kind, const NoiseBlock& cubes, std::span<Interval> bounds) const;

  // What sums are made of, for those who add it up piece by piece with the functions of
  // lib/noise/kernels/noise_kernel.h.

  const NoiseTables& tables() const { return m_noise.tables(); }

  /// Octaves of the sum, the coarsest first.
  std::span<const NoiseOctave> octaves() const { return m_octaves; }

  bool is_warped() const { return m_warp != 0; }

  /// Octaves, of kind fbm, of the displacement along an axis [m]; none without warp.
  std::span<const NoiseOctave> warp_octaves(int axis) const { return m_warp_octaves[axis]; }

 private:
  template <class Places>
  void evaluate_warped(OctaveSum kind, const Places& places, std::vector<Vec3d> points,
                       std::span<float> values, std::span<Vec3f> gradients) const;
  void bound_warped(OctaveSum kind, const NoiseBlock& centres, std::span<Interval> bounds) const;

  PerlinNoise m_noise;
  std::vector<NoiseOctave> m_octaves;          ///< the sum of their amplitudes is 1
  double m_warp;                               ///< the displacements' bound, over kPerlinBound [m]
  std::vector<NoiseOctave> m_warp_octaves[3];  ///< displacement along x, y and z [m]; empty without warp
};

}  // namespace pileus
