// Per-target include guard, as Highway needs it.
#if defined(PILEUS_LIB_NOISE_KERNELS_LATTICE_AXIS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_LIB_NOISE_KERNELS_LATTICE_AXIS_INL_H
#undef PILEUS_LIB_NOISE_KERNELS_LATTICE_AXIS_INL_H
#else
#define PILEUS_LIB_NOISE_KERNELS_LATTICE_AXIS_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Eight lanes at most: a row of a VDB leaf.
using D = hn::CappedTag<float, 8>;
using V = hn::Vec<D>;
constexpr int kLanes = int(hn::MaxLanes(D()));

/// Half as many of double precision.
using DD = hn::Repartition<double, D>;
using VD = hn::Vec<DD>;
constexpr int kDoubleLanes = kLanes / 2;

/// The lattice coordinate `whole`, wrapped to 0 .. period - 1; exact for every finite number.
inline int wrapped(double whole, double period) {
  if (period == 256.0) return int(whole - 256.0 * std::floor(whole / 256.0));
  const double rest = std::fmod(whole, period);
  return int(rest < 0 ? rest + period : rest);
}

/// Points rounded up to whole vectors.
inline int padded(int points) {
  return (points + kLanes - 1) / kLanes * kLanes;
}

/// Points in a row along one axis, in the lattice of one octave, and the lattice lines (planes across the
/// axis) that they lie between.
template <int kMaxPoints>
struct LatticeAxis {
  static constexpr int kMaxLines = 2 * kMaxPoints;

  int points, lines;
  bool is_run;                           ///< each line's hash is the last one's plus 1, modulo 256
  int hash[kMaxLines];                   ///< of each line: its lattice coordinate, wrapped
  int32_t lower[kMaxPoints];             ///< line below each point
  int upper_offset;                      ///< from there to the line above
  alignas(64) float place[kMaxPoints];   ///< from the lower line to the point, 0 .. 1
  alignas(64) float weight[kMaxPoints];  ///< fade(place)
  alignas(64) float weight_slope[kMaxPoints];

  /// x = start + m * step in lattice units, in double precision: places are as good far from the origin.
  ///   period: lattice units after which the noise repeats; 0: the hash's own 256
  LatticeAxis(double start, double step, int count, int period) : points(count) {
    alignas(64) double whole[kMaxPoints];
    const DD dd;
    const VD one = hn::Set(dd, 1.0);
    for (int m = 0; m < padded(count); m += kDoubleLanes) {
      const VD index = hn::Min(hn::Iota(dd, double(m)), hn::Set(dd, double(count - 1)));
      const VD x = hn::Add(hn::Set(dd, start), hn::Mul(index, hn::Set(dd, step)));
      const VD floor = hn::Floor(x);
      const VD t = hn::Sub(x, floor), t2 = hn::Mul(t, t), back = hn::Sub(one, t);
      // fade = t^3 (6t^2 - 15t + 10), fade' = 30 t^2 (1 - t)^2
      const VD inner =
          hn::Add(hn::Mul(t, hn::Sub(hn::Mul(t, hn::Set(dd, 6.0)), hn::Set(dd, 15.0))), hn::Set(dd, 10.0));
      hn::Store(floor, dd, whole + m);
      store_floats(t, place + m);
      store_floats(hn::Mul(hn::Mul(t2, t), inner), weight + m);
      store_floats(hn::Mul(hn::Mul(hn::Set(dd, 30.0), t2), hn::Mul(back, back)), weight_slope + m);
    }
    const double cells = period > 0 ? double(period) : 256.0;
    fits_vectors(whole) ? number_run(whole, cells) : number_pairs(whole, cells);
  }

 private:
  static HWY_INLINE void store_floats(VD values, float* to) {
    const hn::Rebind<float, DD> df;
    hn::Store(hn::DemoteTo(df, values), df, to);
  }

  /// Whether the lines of each vector of points fit into a vector: they are neighbours, and points share
  /// them.
  bool fits_vectors(const double* whole) const {
    for (int v = 0; v < points; v += kLanes) {
      const int last = std::min(v + kLanes, points) - 1;
      if (!(whole[last] - whole[v] + 2 <= kLanes)) return false;
    }
    return whole[points - 1] - whole[0] + 2 <= kMaxLines;
  }

  void number_run(const double* whole, double period) {
    lines = int(whole[points - 1] - whole[0]) + 2;
    is_run = period == 256.0;
    upper_offset = 1;
    int next = wrapped(whole[0], period);
    for (int l = 0; l < lines; ++l) {
      hash[l] = next & 255;
      next = double(next + 1) < period ? next + 1 : 0;
    }
    for (int m = 0; m < padded(points); ++m) lower[m] = int32_t(whole[m] - whole[0]);
  }

  /// Where points are far apart, each has two lines of its own: first all lower ones, then all upper ones.
  void number_pairs(const double* whole, double period) {
    is_run = false;
    upper_offset = padded(points);
    lines = 2 * upper_offset;
    for (int m = 0; m < upper_offset; ++m) {
      lower[m] = m;
      hash[m] = wrapped(whole[m], period) & 255;
      hash[m + upper_offset] = wrapped(whole[m] + 1, period) & 255;
    }
  }
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
