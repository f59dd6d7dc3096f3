// Per-target include guard, as Highway needs it.
#if defined(PILEUS_LIB_NOISE_KERNELS_LATTICE_AXIS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_LIB_NOISE_KERNELS_LATTICE_AXIS_INL_H
#undef PILEUS_LIB_NOISE_KERNELS_LATTICE_AXIS_INL_H
#else
#define PILEUS_LIB_NOISE_KERNELS_LATTICE_AXIS_INL_H
#endif

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

/// 6t^5 - 15t^4 + 10t^3
inline double fade(double t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}

/// The lattice coordinate `whole`, wrapped to 0 .. 255; exact for every finite number.
inline int wrapped(double whole) {
  return int(whole - 256.0 * std::floor(whole / 256.0));
}

/// Points in a row along one axis, in the lattice of one octave. The lattice lines (planes across the axis)
/// that they need are numbered from 0: a point lies between line[m] and line[m] + 1.
template <int kMaxPoints>
struct LatticeAxis {
  static constexpr int kMaxLines = 2 * kMaxPoints;

  int points, lines;
  bool is_contiguous;                    ///< the lines are neighbours in the lattice
  int hash[kMaxLines];                   ///< of each line: its lattice coordinate, wrapped
  alignas(64) int32_t line[kMaxPoints];  ///< below each point
  alignas(64) float place[kMaxPoints];   ///< from that line to the point, 0 .. 1
  alignas(64) float weight[kMaxPoints];  ///< fade(place)

  /// x = start + m * step in lattice units, in double precision: places are as good far from the origin.
  LatticeAxis(double start, double step, int count) : points(count) {
    double whole[kMaxPoints];
    for (int m = 0; m < count; ++m) {
      const double x = start + double(m) * step;
      whole[m] = std::floor(x);
      place[m] = float(x - whole[m]);
      weight[m] = float(fade(x - whole[m]));
    }
    const double span = whole[count - 1] - whole[0];
    is_contiguous = span + 2 <= 2 * count;
    is_contiguous ? number_all(whole, int(span) + 2) : number_pairs(whole);
    for (int m = count; m < kMaxPoints; ++m) line[m] = line[count - 1], place[m] = weight[m] = 0.0f;
  }

 private:
  void number_all(const double* whole, int count) {
    lines = count;
    const int first = wrapped(whole[0]);
    for (int l = 0; l < lines; ++l) hash[l] = (first + l) & 255;
    for (int m = 0; m < points; ++m) line[m] = int32_t(whole[m] - whole[0]);
  }

  /// Where points are far apart, each has two lines of its own.
  void number_pairs(const double* whole) {
    lines = 2 * points;
    for (int m = 0; m < points; ++m) {
      line[m] = 2 * m;
      hash[2 * m] = wrapped(whole[m]);
      hash[2 * m + 1] = (hash[2 * m] + 1) & 255;
    }
  }
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
