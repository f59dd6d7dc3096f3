// Per-target include guard, as Highway needs it.
#if defined(PILEUS_LIB_NOISE_KERNELS_NOISE_SUMS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_LIB_NOISE_KERNELS_NOISE_SUMS_INL_H
#undef PILEUS_LIB_NOISE_KERNELS_NOISE_SUMS_INL_H
#else
#define PILEUS_LIB_NOISE_KERNELS_NOISE_SUMS_INL_H
#endif

#include <algorithm>
#include <cmath>

#include "hwy/highway.h"

#include "lib/noise/kernels/noise_block-inl.h"
#include "lib/noise/kernels/noise_kernel.h"
#include "lib/noise/perlin_bounds.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// What an octave adds to a sum, of noise that has been scaled: amplitude * shape(n).
template <OctaveSum kKind>
struct OctaveShape {
  float scale;  ///< of the noise

  explicit OctaveShape(double amplitude)
      : scale(float(kKind == OctaveSum::ridged ? std::sqrt(amplitude) : amplitude)) {}

  HWY_INLINE V add(V sum, V noise) const {
    if constexpr (kKind == OctaveSum::fbm) return hn::Add(sum, noise);
    if constexpr (kKind == OctaveSum::billow) return hn::Add(sum, hn::Abs(noise));
    if constexpr (kKind == OctaveSum::ridged) {
      const V height = hn::Sub(hn::Set(D(), scale), hn::Abs(noise));
      return hn::MulAdd(height, height, sum);
    }
  }

  /// The derivative of the sum along the way on which the noise grows by `slope`.
  HWY_INLINE V slope(V noise, V slope) const {
    const D d;
    if constexpr (kKind == OctaveSum::fbm) return slope;
    const V signed_slope = hn::Xor(slope, hn::And(noise, hn::SignBit(d)));
    if constexpr (kKind == OctaveSum::billow) return signed_slope;
    if constexpr (kKind == OctaveSum::ridged) {
      const V height = hn::Sub(hn::Set(d, scale), hn::Abs(noise));
      return hn::Mul(hn::Mul(hn::Set(d, -2.0f), height), signed_slope);
    }
  }
};

template <OctaveSum kKind>
void sum_block(const NoiseTables& tables, std::span<const NoiseOctave> octaves, const NoiseBlock& block,
               float* values) {
  const D d;
  HWY_ALIGN float sums[kTileFloats];
  for_each_tile(block, [&](const Tile& tile, const AxisOrder& order, size_t first) HWY_ATTR {
    std::fill_n(sums, tile_floats(tile, order), 0.0f);
    for (const NoiseOctave& octave : octaves) {
      const OctaveShape<kKind> shape(octave.amplitude);
      OctaveTile<false>(tables, octave, tile, order).visit(shape.scale, [&](int at, V noise) HWY_ATTR {
        hn::Store(shape.add(hn::Load(d, sums + at), noise), d, sums + at);
      });
    }
    for_each_row(block, tile, order, first,
                 [&](size_t at, int row, int count) { std::copy_n(sums + row, count, values + at); });
  });
}

/// One octave's scaled noise over a tile, and its slopes across, down and along.
struct TileNoise {
  HWY_ALIGN float values[4][kTileFloats];

  void evaluate(const NoiseTables& tables, const NoiseOctave& octave, const Tile& tile,
                const AxisOrder& order, float scale) {
    const D d;
    OctaveTile<true>(tables, octave, tile, order)
        .visit(scale, [&](int at, V noise, V across, V down, V along) HWY_ATTR {
          hn::Store(noise, d, values[0] + at);
          hn::Store(across, d, values[1] + at);
          hn::Store(down, d, values[2] + at);
          hn::Store(along, d, values[3] + at);
        });
  }
};

/// The same sum with gradients in world space.
template <OctaveSum kKind>
void sum_block(const NoiseTables& tables, std::span<const NoiseOctave> octaves, const NoiseBlock& block,
               float* values, Vec3f* gradients) {
  const D d;
  TileNoise one;
  HWY_ALIGN float sums[4][kTileFloats];
  for_each_tile(block, [&](const Tile& tile, const AxisOrder& order, size_t first) HWY_ATTR {
    const int floats = tile_floats(tile, order);
    for (auto& sum : sums) std::fill_n(sum, floats, 0.0f);
    for (const NoiseOctave& octave : octaves) {
      const OctaveShape<kKind> shape(octave.amplitude);
      const V frequency = hn::Set(d, float(octave.frequency));
      one.evaluate(tables, octave, tile, order, shape.scale);
      for (int i = 0; i < floats; i += kLanes) {
        const V noise = hn::Load(d, one.values[0] + i);
        hn::Store(shape.add(hn::Load(d, sums[0] + i), noise), d, sums[0] + i);
        for (int c = 1; c < 4; ++c) {
          const V slope = shape.slope(noise, hn::Load(d, one.values[c] + i));
          hn::Store(hn::MulAdd(frequency, slope, hn::Load(d, sums[c] + i)), d, sums[c] + i);
        }
      }
    }
    for_each_row(block, tile, order, first, [&](size_t at, int row, int count) {
      std::copy_n(sums[0] + row, count, values + at);
      for (int m = 0; m < count; ++m) {
        Vec3f& gradient = gradients[at + size_t(m)];
        gradient[order.across] = sums[1][row + m];
        gradient[order.down] = sums[2][row + m];
        gradient[order.along] = sums[3][row + m];
      }
    });
  });
}

/// How far an octave's noise strays in a cube from its value in the centre.
struct Stray {
  float half;    ///< half the cube's edge [lattice units]
  float flat;    ///< at most this far
  float curved;  ///< from the tangent at most this far

  explicit Stray(double half_edge)
      : half(float(half_edge)),
        flat(float(kPerlinCubeSlope * half_edge)),
        curved(float(0.5 * kPerlinCubeCurvature * half_edge * half_edge)) {}

  /// Whether that can tell more than the bound of all space.
  bool tells() const { return std::min(flat, curved) < float(kPerlinBound); }
};

/// lo, hi += amplitude * (bounds of the noise's shape in cubes around the points)
template <OctaveSum kKind>
void add_bounds(const TileNoise& noise, const Stray& stray, float amplitude, int floats, float* lo,
                float* hi) {
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), factor = hn::Set(d, amplitude);
  const V half = hn::Set(d, stray.half), flat = hn::Set(d, stray.flat), curved = hn::Set(d, stray.curved);
  const V limit = hn::Set(d, float(kPerlinBound));
  for (int i = 0; i < floats; i += kLanes) {
    const auto slope = [&](int c) HWY_ATTR { return hn::Abs(hn::Load(d, noise.values[c] + i)); };
    const V slopes = hn::Add(hn::Add(slope(1), slope(2)), slope(3));
    const V radius = hn::Min(flat, hn::MulAdd(slopes, half, curved));
    const V centre = hn::Load(d, noise.values[0] + i);
    V least = hn::Max(hn::Sub(centre, radius), hn::Neg(limit));
    V most = hn::Min(hn::Add(centre, radius), limit);
    if constexpr (kKind != OctaveSum::fbm) {  // |n|
      const V size = hn::Max(hn::Neg(least), most);
      least = hn::Max(hn::Max(least, hn::Neg(most)), zero);
      most = size;
    }
    if constexpr (kKind == OctaveSum::ridged) {  // (1 - |n|)^2; |n| exceeds 1 by less than 0.04
      const V top = hn::Sub(one, least), bottom = hn::Max(hn::Sub(one, most), zero);
      least = hn::Mul(bottom, bottom);
      most = hn::Max(hn::Mul(top, top), hn::Set(d, 0.0016f));
    }
    hn::Store(hn::MulAdd(factor, least, hn::Load(d, lo + i)), d, lo + i);
    hn::Store(hn::MulAdd(factor, most, hn::Load(d, hi + i)), d, hi + i);
  }
}

/// Cube (i, j, k) has its centre at point (i, j, k) of the block and the spacing as its edge.
template <OctaveSum kKind>
void bound_cubes(const NoiseTables& tables, std::span<const NoiseOctave> octaves, const NoiseBlock& block,
                 float* lo, float* hi) {
  TileNoise one;
  HWY_ALIGN float sums[2][kTileFloats];
  for_each_tile(block, [&](const Tile& tile, const AxisOrder& order, size_t first) HWY_ATTR {
    const int floats = tile_floats(tile, order);
    for (auto& sum : sums) std::fill_n(sum, floats, 0.0f);
    float all_lo = 0.0f, all_hi = 0.0f;  // of the octaves that are finer than the cubes
    for (const NoiseOctave& octave : octaves) {
      const Stray stray(half_edge(octave, tile));
      const float amplitude = float(octave.amplitude);
      if (stray.tells()) {
        one.evaluate(tables, octave, tile, order, 1.0f);
        add_bounds<kKind>(one, stray, amplitude, floats, sums[0], sums[1]);
      } else {
        if (kKind == OctaveSum::fbm) all_lo -= amplitude * float(kPerlinBound);
        all_hi += amplitude * (kKind == OctaveSum::ridged ? 1.0f : float(kPerlinBound));
      }
    }
    for_each_row(block, tile, order, first, [&](size_t at, int row, int count) {
      for (int m = 0; m < count; ++m) {
        lo[at + size_t(m)] = sums[0][row + m] + all_lo;
        hi[at + size_t(m)] = sums[1][row + m] + all_hi;
      }
    });
  });
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
