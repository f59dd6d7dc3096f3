// Densities along rows of lines towards the sun.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_DENSITY_ROWS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_DENSITY_ROWS_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_DENSITY_ROWS_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_DENSITY_ROWS_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/readers-inl.h"
#include "integrators/kernels/sun_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Adds up densities of lines that are neighbours along one of the grid's axes. Those of all lines come from
/// sums of whole rows of voxels, or of their means, and then from one linear interpolation: nothing is
/// gathered.
class DensityRows {
 public:
  /// Means reach so much further than the values that are in them [cells].
  static constexpr double kMeansReach = 2.0;

  /// Rows of up to so many lines, v apart.
  DensityRows(const SunSweep& sweep, int columns)
      : m_sweep(sweep),
        m_pyramid(*sweep.grid->pyramid),
        m_row(size_t(kCells) * (size_t(double(columns) * sweep.ev[sweep.lane_axis] / kCells) + 3) + 4) {}

  /// Adds the densities of the lines [begin, end), multiples of kLanes, of a row that begins at p to
  /// rho[line]; false where there are none.
  bool add(const Vec3d& p, int begin, int end, float* rho) {
    m_begin = begin, m_end = end, m_rho = rho;
    return m_sweep.is_halved ? add_means(p) : add_values(p);
  }

  /// Densities that have been added.
  uint64_t samples() const { return m_samples; }

 private:
  bool add_values(const Vec3d& p) {
    const Vec3i& nodes = m_pyramid.levels().front().nodes;
    const int a = m_sweep.lane_axis, b = (a + 1) % 3, c = (a + 2) % 3;
    for (const int axis : {b, c}) {
      if (!(p[axis] >= 0.0 && p[axis] < double(nodes[axis] * kCells))) return false;
    }
    const Vec3i cell(int(p.x), int(p.y), int(p.z));
    const int table_strides[3] = {nodes.y * nodes.z, nodes.z, 1};
    const int32_t* const table =
        m_pyramid.offsets().data() + (cell[b] >> 3) * table_strides[b] + (cell[c] >> 3) * table_strides[c];
    // Bricks that lanes lie in, as far as there are any.
    const double across = m_sweep.ev[a];
    const auto brick_at = [&](int column) { return int(std::floor((p[a] + across * column) / kCells)); };
    int lo = std::max(0, brick_at(m_begin)), hi = std::min(nodes[a] - 1, brick_at(m_end - 1));
    while (lo <= hi && table[lo * table_strides[a]] == 0) ++lo;
    while (lo <= hi && table[hi * table_strides[a]] == 0) --hi;
    if (lo > hi) return false;
    constexpr int kStrides[3] = {BrickGrid::kStrideX, BrickGrid::kStrideY, BrickGrid::kStrideZ};
    const int inside = (cell[b] & 7) * kStrides[b] + (cell[c] & 7) * kStrides[c];
    const float fb = float(p[b] - cell[b]), fc = float(p[c] - cell[c]);
    const QuantizedValues* const quantized = m_pyramid.quantized();
    const float scale = quantized ? float(quantized->scale) : 1.0f;
    const float weights[4] = {scale * (1.0f - fb) * (1.0f - fc), scale * fb * (1.0f - fc),
                              scale * (1.0f - fb) * fc, scale * fb * fc};
    const auto sum_brick = [&](const auto* values, float* out) HWY_ATTR {
      if (a == 2) {
        sum_rows<BrickGrid::kStrideZ>(values, kStrides[b], kStrides[c], weights, out);
      } else {
        sum_rows<BrickGrid::kStrideY>(values, kStrides[b], kStrides[c], weights, out);
      }
    };
    float* out = m_row.data() + 1;
    for (int brick = lo; brick <= hi; ++brick, out += kCells) {
      const int32_t offset = table[brick * table_strides[a]];
      if (offset == 0) {
        std::fill_n(out, kCells + 1, 0.0f);
      } else if (quantized) {
        sum_brick(quantized->stored.get() + offset + inside, out);
      } else {
        sum_brick(m_pyramid.grid().all_values().data() + offset + inside, out);
      }
    }
    resample(float(p[a] - lo * kCells), float(across), (hi - lo + 1) * kCells);
    return true;
  }

  /// The four rows of means that a row of lines lies between, [db + 2 dc].
  struct MeanRows {
    const int32_t* tables[4];  ///< bricks along the row
    int inside[4];             ///< where it begins in them
    float weights[4];
  };

  bool add_means(const Vec3d& p) {
    constexpr int kSide = 4;  // means of a brick, along each axis
    const Vec3i& nodes = m_pyramid.levels().front().nodes;
    const Vec3d at = 0.5 * (p - Vec3d(0.5));
    const int a = m_sweep.lane_axis, b = (a + 1) % 3, c = (a + 2) % 3;
    for (const int axis : {b, c}) {
      if (!(at[axis] >= 0.0 && at[axis] < double(nodes[axis] * kSide - 1))) return false;
    }
    const MeanRows rows = mean_rows(Vec2i(int(at[b]), int(at[c])), Vec2d(at[b], at[c]));
    const int stride = a == 2 ? 1 : nodes.z;  // between the table's bricks along the row
    const double across = 0.5 * m_sweep.ev[a];
    const auto brick_at = [&](int column, int more) {
      return int(std::floor((at[a] + across * column + more) / kSide));
    };
    const auto is_empty = [&](int brick) {
      int32_t any = 0;
      for (const int32_t* table : rows.tables) any |= table[brick * stride];
      return any == 0;
    };
    int lo = std::max(0, brick_at(m_begin, 0)), hi = std::min(nodes[a] - 1, brick_at(m_end - 1, 1));
    while (lo <= hi && is_empty(lo)) ++lo;
    while (lo <= hi && is_empty(hi)) --hi;
    if (lo > hi) return false;
    // Before the first mean and behind the last lies a cell that ends in zero.
    float* out = m_row.data() + 1;
    *out++ = 0.0f;
    for (int brick = lo; brick <= hi; ++brick, out += kSide) {
      if (is_empty(brick)) {
        std::fill_n(out, kSide, 0.0f);
      } else if (a == 2) {
        sum_means<kMeansZ>(rows, brick * stride, out);
      } else {
        sum_means<kMeansY>(rows, brick * stride, out);
      }
    }
    *out = 0.0f;
    resample(float(at[a] - lo * kSide + 1.0), float(across), (hi - lo + 1) * kSide + 1);
    return true;
  }

  MeanRows mean_rows(const Vec2i& cell, const Vec2d& at) const {
    constexpr int kStrides[3] = {kMeansX, kMeansY, kMeansZ};
    const Vec3i& nodes = m_pyramid.levels().front().nodes;
    const int table_strides[3] = {nodes.y * nodes.z, nodes.z, 1};
    const int b = (m_sweep.lane_axis + 1) % 3, c = (m_sweep.lane_axis + 2) % 3;
    const float fb = float(at.x - cell.x), fc = float(at.y - cell.y),
                scale = float(m_pyramid.quantized()->scale);
    MeanRows rows;
    for (int n = 0; n < 4; ++n) {
      const int db = n & 1, dc = n >> 1, ib = cell.x + db, ic = cell.y + dc;
      rows.tables[n] =
          m_pyramid.offsets().data() + (ib >> 2) * table_strides[b] + (ic >> 2) * table_strides[c];
      rows.inside[n] = (ib & 3) * kStrides[b] + (ic & 3) * kStrides[c];
      rows.weights[n] = scale * (db ? fb : 1.0f - fb) * (dc ? fc : 1.0f - fc);
    }
    return rows;
  }

  /// The four densities along a brick, from means.
  template <int kStride>
  HWY_INLINE void sum_means(const MeanRows& rows, int brick, float* out) const {
    const hn::CappedTag<float, 4> d;
    const int16_t* means[4];
    for (int n = 0; n < 4; ++n) {
      means[n] = m_pyramid.quantized()->means.get() +
                 rows.tables[n][brick] / QuantizedValues::kPitch * QuantizedValues::kMeansPitch +
                 rows.inside[n];
    }
    if constexpr (kStride == 1) {
      auto sum = hn::Zero(d);
      for (int n = 0; n < 4; ++n)
        sum = hn::MulAdd(load_values(d, means[n]), hn::Set(d, rows.weights[n]), sum);
      hn::StoreU(sum, d, out);
    } else {
      for (int k = 0; k < 4; ++k) {
        out[k] = 0.0f;
        for (int n = 0; n < 4; ++n) out[k] += rows.weights[n] * value_of(means[n][k * kStride]);
      }
    }
  }

  /// The densities along a brick: eight, and the one at its end, which the next
  /// brick has first.
  template <int kStride, class T>
  static HWY_INLINE void sum_rows(const T* values, int stride_b, int stride_c, const float* weights,
                                  float* out) {
    if constexpr (kStride == 1) {
      const hn::CappedTag<float, 8> d;
      const auto w0 = hn::Set(d, weights[0]), w1 = hn::Set(d, weights[1]), w2 = hn::Set(d, weights[2]),
                 w3 = hn::Set(d, weights[3]);
      for (int k = 0; k < kCells; k += int(hn::Lanes(d))) {
        const T* const v = values + k;
        const auto near = hn::MulAdd(w1, load_values(d, v + stride_b), hn::Mul(w0, load_values(d, v)));
        const auto far = hn::MulAdd(w3, load_values(d, v + stride_b + stride_c),
                                    hn::Mul(w2, load_values(d, v + stride_c)));
        hn::StoreU(hn::Add(near, far), d, out + k);
      }
    } else {
      for (int k = 0; k < kCells; ++k) out[k] = sum_at(values + k * kStride, stride_b, stride_c, weights);
    }
    out[kCells] = sum_at(values + kCells * kStride, stride_b, stride_c, weights);
  }

  template <class T>
  static HWY_INLINE float sum_at(const T* v, int stride_b, int stride_c, const float* weights) {
    return (weights[0] * value_of(v[0]) + weights[1] * value_of(v[stride_b])) +
           (weights[2] * value_of(v[stride_c]) + weights[3] * value_of(v[stride_b + stride_c]));
  }

  /// 16-bit values count in steps.
  static HWY_INLINE float value_of(float value) { return value; }
  static HWY_INLINE float value_of(int16_t stored) { return float(stored + QuantizedValues::kZero); }

  template <class D8>
  static HWY_INLINE hn::Vec<D8> load_values(D8 d, const float* values) {
    return hn::LoadU(d, values);
  }
  template <class D8>
  static HWY_INLINE hn::Vec<D8> load_values(D8 d, const int16_t* stored) {
    const hn::RebindToSigned<D8> di;
    const hn::Rebind<int16_t, D8> di16;
    const auto steps =
        hn::Add(hn::PromoteTo(di, hn::LoadU(di16, stored)), hn::Set(di, QuantizedValues::kZero));
    return hn::ConvertTo(d, steps);
  }

  /// Adds m_row, of `count` cells, at `first` + lane * `across`; 0 beyond it.
  void resample(float first, float across, int count) {
    const D d;
    // Beyond the ends lie zeros: what is outside reads there.
    m_row[0] = 0.0f;
    m_row[size_t(count) + 2] = 0.0f;
    const V lane = hn::Iota(d, 0.0f), most = hn::Set(d, float(count) + 1.0f), zero = hn::Zero(d);
    const auto column_at = [&](float place) {
      return int((place - first) / across) / int(kLanes) * int(kLanes);
    };
    const int begin = std::max(m_begin, first >= 0.0f ? 0 : column_at(0.0f)),
              end = std::min(m_end - int(kLanes), column_at(float(count)));
    for (int column = begin; column <= end; column += int(kLanes)) {
      const V at =
          hn::MulAdd(hn::Add(lane, hn::Set(d, float(column))), hn::Set(d, across), hn::Set(d, first + 1.0f));
      const V inside = hn::Min(hn::Max(at, zero), most);
      const VI cell = truncate_small(inside);
      V lower, upper;
      load_pairs(d, m_row.data(), cell, lower, upper);
      const V rho = hn::MulAdd(hn::Sub(inside, hn::ConvertTo(d, cell)), hn::Sub(upper, lower), lower);
      hn::StoreU(hn::Add(rho, hn::LoadU(d, m_rho + column)), d, m_rho + column);
    }
    if (end >= begin) m_samples += uint64_t(end - begin) + kLanes;
  }

  static constexpr int kCells = SunLattice::kBrickCells;
  static constexpr int kMeansX = 16, kMeansY = 4, kMeansZ = 1;  ///< strides of means in a brick

  const SunSweep& m_sweep;
  const BrickPyramid& m_pyramid;
  std::vector<float> m_row;  ///< densities of a row of cells, behind a zero
  int m_begin = 0, m_end = 0;
  float* m_rho = nullptr;
  uint64_t m_samples = 0;
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
