// Per-target include guard, as Highway needs it.
#if defined(PILEUS_LIB_NOISE_KERNELS_NOISE_BLOCK_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_LIB_NOISE_KERNELS_NOISE_BLOCK_INL_H
#undef PILEUS_LIB_NOISE_KERNELS_NOISE_BLOCK_INL_H
#else
#define PILEUS_LIB_NOISE_KERNELS_NOISE_BLOCK_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <cstring>

#include "hwy/highway.h"

#include "lib/noise/kernels/lattice_axis-inl.h"
#include "lib/noise/kernels/noise_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Noise in a block is linear in each corner's gradient, and so can be summed axis by axis (across, down and
// along; "along" is the axis of the rows, whose points are the lanes):
//   1. lattice:  the number of the gradient of every lattice point that the block needs
//   2. across:   for one plane of points, the two lattice planes beside it are mixed
//   3. along:    mixed lattice rows -> rows of points, still on lattice lines of the third axis:
//                ramp P without, and slope Q along, that third axis
//   4. down:     per row of points, two lattice rows are mixed: three multiply-adds per vector of points
// Steps 1 to 3 are shared by many points, because voxels are smaller than cells.

constexpr int kTileEdge = 8;  ///< points of a tile across and down
constexpr int kTileRow = 64;  ///< and along
constexpr int kMaxDownLines = LatticeAxis<kTileEdge>::kMaxLines;
constexpr int kMaxRowLines = LatticeAxis<kTileRow>::kMaxLines;

/// Twice the x, y and z component of the 16 gradients, as the highest byte of a float: 0x40 is 2, 0xC0 is -2.
HWY_ALIGN constexpr uint8_t kGradientBytes[3][16] = {
    {0x40, 0xC0, 0x40, 0xC0, 0x40, 0xC0, 0x40, 0xC0, 0, 0, 0, 0, 0x40, 0, 0xC0, 0},
    {0x40, 0x40, 0xC0, 0xC0, 0, 0, 0, 0, 0x40, 0xC0, 0x40, 0xC0, 0x40, 0xC0, 0x40, 0xC0},
    {0, 0, 0, 0, 0x40, 0x40, 0xC0, 0xC0, 0x40, 0x40, 0xC0, 0xC0, 0, 0x40, 0, 0xC0}};

/// Part of a block, small enough for fixed arrays: `count` points from `origin` on.
struct Tile {
  Vec3d origin;
  double spacing;
  int count[3];
};

/// The axes of a block by their part in the sum.
struct AxisOrder {
  int across, down, along;
};

/// Rows lie along the last axis that has more than one point: values stay contiguous.
inline AxisOrder axis_order(const Vec3i& count) {
  if (count.z > 1) return {0, 1, 2};
  if (count.y > 1) return {0, 2, 1};
  return {1, 2, 0};
}

/// Floats from one row of a tile to the next.
inline int row_stride(int points) {
  return (points + kLanes - 1) / kLanes * kLanes;
}

/// One octave over one tile.
class OctaveTile {
 public:
  OctaveTile(const NoiseTables& tables, const NoiseOctave& octave, const Tile& tile, const AxisOrder& order)
      : m_tables(tables),
        m_order(order),
        m_across(start(octave, tile, order.across), tile.spacing * octave.frequency,
                 tile.count[order.across]),
        m_down(start(octave, tile, order.down), tile.spacing * octave.frequency, tile.count[order.down]),
        m_along(start(octave, tile, order.along), tile.spacing * octave.frequency, tile.count[order.along]),
        m_rows(m_down.lines * m_along.lines) {
    for (int v = 0; v * kLanes < m_along.points; ++v) {
      const int32_t* line = m_along.line + v * kLanes;
      const int last = std::min(kLanes, m_along.points - v * kLanes) - 1;
      m_fits_vector = m_fits_vector && line[last] + 2 - line[0] <= kLanes;
    }
  }

  /// sums[across][down][along] (rows of whole vectors) += shape(scale * noise)
  template <class Shape>
  void add(float scale, const Shape& shape, float* sums) {
    for (int a = 0; a < m_across.points; ++a) {
      mix_across(a, scale);
      m_fits_vector ? expand_rows<true>() : expand_rows<false>();
      mix_down(shape, sums + a * m_down.points * row_stride(m_along.points));
    }
  }

 private:
  static double start(const NoiseOctave& octave, const Tile& tile, int axis) {
    return tile.origin[axis] * octave.frequency + octave.shift[axis];
  }

  /// Fills a slot with the components (across, down, along) of the gradients on one lattice plane.
  void load_plane(int line) {
    const int slot = line & 1;
    if (m_loaded[slot] == line) return;
    m_loaded[slot] = line;
    number_gradients(line);
    const D d;
    const hn::RebindToUnsigned<D> du;
    const hn::Repartition<uint8_t, D> du8;
    const hn::Rebind<uint8_t, D> du8_short;
    const int axes[3] = {m_order.across, m_order.down, m_order.along};
    for (int i = 0; i < m_rows; i += kLanes) {
      const auto number = hn::PromoteTo(du, hn::LoadU(du8_short, m_numbers + i));
      // The number stands in the highest byte; the others pick nothing.
      const auto pick = hn::Or(hn::ShiftLeft<24>(number), hn::Set(du, 0x00808080u));
      for (int c = 0; c < 3; ++c) {
        const auto table = hn::LoadDup128(du8, kGradientBytes[axes[c]]);
        hn::Store(hn::BitCast(d, hn::TableLookupBytesOr0(table, hn::BitCast(du8, pick))), d,
                  m_gradient[slot][c] + i);
      }
    }
  }

  /// m_numbers[down][along]: numbers of the gradients on the lattice plane `line` across.
  void number_gradients(int line) {
    const uint8_t* const hash = m_tables.hash.data();
    const uint8_t* const gradient = m_tables.gradient.data();
    uint8_t* out = m_numbers;
    for (int j = 0; j < m_down.lines; ++j, out += m_along.lines) {
      if (m_order.along == 2) {  // x across, y down
        const uint8_t* const row = gradient + hash[hash[m_across.hash[line]] + m_down.hash[j]];
        if (m_along.is_contiguous) {
          // Eight at a time: what is written beyond the row, the next one overwrites.
          for (int k = 0; k < m_along.lines; k += 8) std::memcpy(out + k, row + m_along.hash[0] + k, 8);
        } else {
          for (int k = 0; k < m_along.lines; ++k) out[k] = row[m_along.hash[k]];
        }
      } else if (m_order.along == 1) {  // x across, z down
        const uint8_t* const column = hash + hash[m_across.hash[line]];
        for (int k = 0; k < m_along.lines; ++k) out[k] = gradient[column[m_along.hash[k]] + m_down.hash[j]];
      } else {  // y across, z down
        for (int k = 0; k < m_along.lines; ++k) {
          out[k] = gradient[hash[hash[m_along.hash[k]] + m_across.hash[line]] + m_down.hash[j]];
        }
      }
    }
  }

  /// m_mixed: the lattice planes beside point a, weighted: ramp across, slope down, slope along.
  void mix_across(int a, float scale) {
    const int line = m_across.line[a];
    load_plane(line);
    load_plane(line + 1);
    const auto& near = m_gradient[line & 1];
    const auto& far = m_gradient[(line + 1) & 1];
    const D d;
    const float weight = m_across.weight[a], place = m_across.place[a];
    const V near_weight = hn::Set(d, 0.5f * scale * (1.0f - weight)),
            far_weight = hn::Set(d, 0.5f * scale * weight);
    const V near_way = hn::Mul(near_weight, hn::Set(d, place)),
            far_way = hn::Mul(far_weight, hn::Set(d, place - 1.0f));
    for (int i = 0; i < m_rows; i += kLanes) {
      const auto mix = [&](int c, V w0, V w1) HWY_ATTR {
        return hn::MulAdd(w1, hn::Load(d, far[c] + i), hn::Mul(w0, hn::Load(d, near[c] + i)));
      };
      hn::Store(mix(0, near_way, far_way), d, m_mixed[0] + i);
      hn::Store(mix(1, near_weight, far_weight), d, m_mixed[1] + i);
      hn::Store(mix(2, near_weight, far_weight), d, m_mixed[2] + i);
    }
  }

  /// m_ramp, m_slope: values along the rows of points on each lattice line down.
  template <bool kFitsVector>
  void expand_rows() {
    const D d;
    const hn::RebindToSigned<D> di;
    for (int v = 0; v * kLanes < m_along.points; ++v) {
      const V place = hn::Load(d, m_along.place + v * kLanes),
              weight = hn::Load(d, m_along.weight + v * kLanes);
      const V back = hn::Sub(place, hn::Set(d, 1.0f));
      const auto line = hn::Load(di, m_along.line + v * kLanes);
      const int first = kFitsVector ? m_along.line[v * kLanes] : 0;
      const auto lower = hn::Sub(line, hn::Set(di, first));
      const auto upper = hn::Add(lower, hn::Set(di, 1));
      for (int j = 0; j < m_down.lines; ++j) {
        const int at = j * m_along.lines + first;
        const auto look_up = [&](int c, const auto& index) HWY_ATTR {
          if constexpr (kFitsVector) {
            return hn::TableLookupLanes(hn::LoadU(d, m_mixed[c] + at), hn::IndicesFromVec(d, index));
          } else {
            return hn::GatherIndex(d, m_mixed[c] + at, index);
          }
        };
        const V ramp0 = hn::MulAdd(look_up(2, lower), place, look_up(0, lower));
        const V ramp1 = hn::MulAdd(look_up(2, upper), back, look_up(0, upper));
        const V slope0 = look_up(1, lower), slope1 = look_up(1, upper);
        hn::Store(hn::MulAdd(weight, hn::Sub(ramp1, ramp0), ramp0), d, m_ramp[j] + v * kLanes);
        hn::Store(hn::MulAdd(weight, hn::Sub(slope1, slope0), slope0), d, m_slope[j] + v * kLanes);
      }
    }
  }

  /// sums[down][along] += shape(noise)
  template <class Shape>
  void mix_down(const Shape& shape, float* sums) {
    const D d;
    const int stride = row_stride(m_along.points);
    for (int b = 0; b < m_down.points;) {
      const int line = m_down.line[b];
      int end = b + 1;
      while (end < m_down.points && m_down.line[end] == line) ++end;
      for (int i = 0; i < m_along.points; i += kLanes) {
        // lerp(w, P0 + Q0 y, P1 + Q1 (y - 1)), with the differences of both lines taken once.
        const V ramp = hn::Load(d, m_ramp[line] + i), slope = hn::Load(d, m_slope[line] + i);
        const V slope1 = hn::Load(d, m_slope[line + 1] + i);
        const V step = hn::Sub(hn::Sub(hn::Load(d, m_ramp[line + 1] + i), slope1), ramp);
        const V slope_step = hn::Sub(slope1, slope);
        for (int m = b; m < end; ++m) {
          const V place = hn::Set(d, m_down.place[m]), weight = hn::Set(d, m_down.weight[m]);
          const V noise =
              hn::MulAdd(weight, hn::MulAdd(place, slope_step, step), hn::MulAdd(place, slope, ramp));
          float* const sum = sums + m * stride + i;
          hn::Store(shape(hn::Load(d, sum), noise), d, sum);
        }
      }
      b = end;
    }
  }

  const NoiseTables& m_tables;
  const AxisOrder m_order;
  const LatticeAxis<kTileEdge> m_across, m_down;
  const LatticeAxis<kTileRow> m_along;
  const int m_rows;           ///< lattice points of a plane: rows of m_along.lines, one after another
  bool m_fits_vector = true;  ///< the lattice lines of each vector of points fit into one
  int m_loaded[2] = {-1, -1};
  // Loads of whole vectors run over the end of what is used.
  static constexpr int kPlane = kMaxDownLines * kMaxRowLines + 16;
  uint8_t m_numbers[kPlane];
  alignas(64) float m_gradient[2][3][kPlane];
  alignas(64) float m_mixed[3][kPlane];
  alignas(64) float m_ramp[kMaxDownLines][kTileRow];
  alignas(64) float m_slope[kMaxDownLines][kTileRow];
};

/// sum + n, with the amplitude in n
struct AddNoise {
  static float scale(double amplitude) { return float(amplitude); }
  HWY_INLINE V operator()(V sum, V noise) const { return hn::Add(sum, noise); }
};

/// sum + |n|
struct AddBillow {
  static float scale(double amplitude) { return float(amplitude); }
  HWY_INLINE V operator()(V sum, V noise) const { return hn::Add(sum, hn::Abs(noise)); }
};

/// sum + (s - |n|)^2, with s, the root of the amplitude, in n
struct AddRidge {
  float root;

  static float scale(double amplitude) { return float(std::sqrt(amplitude)); }
  HWY_INLINE V operator()(V sum, V noise) const {
    const V below = hn::Sub(hn::Set(D(), root), hn::Abs(noise));
    return hn::MulAdd(below, below, sum);
  }
};

/// All octaves over one tile, into sums[across][down][along] in rows of whole vectors.
template <OctaveSum kKind>
void sum_tile(const NoiseTables& tables, std::span<const NoiseOctave> octaves, const Tile& tile,
              const AxisOrder& order, float* sums) {
  const int rows = tile.count[order.across] * tile.count[order.down];
  std::fill(sums, sums + rows * row_stride(tile.count[order.along]), 0.0f);
  for (const NoiseOctave& octave : octaves) {
    OctaveTile lattice(tables, octave, tile, order);
    if constexpr (kKind == OctaveSum::fbm) {
      lattice.add(AddNoise::scale(octave.amplitude), AddNoise{}, sums);
    } else if constexpr (kKind == OctaveSum::billow) {
      lattice.add(AddBillow::scale(octave.amplitude), AddBillow{}, sums);
    } else {
      const float root = AddRidge::scale(octave.amplitude);
      lattice.add(root, AddRidge{root}, sums);
    }
  }
}

/// Cuts a block into tiles and puts their sums in their places.
template <OctaveSum kKind>
void sum_block(const NoiseTables& tables, std::span<const NoiseOctave> octaves, const NoiseBlock& block,
               float* values) {
  const AxisOrder order = axis_order(block.count);
  const size_t stride[3] = {size_t(block.count.y) * size_t(block.count.z), size_t(block.count.z), 1};
  HWY_ALIGN float sums[kTileEdge * kTileEdge * kTileRow];
  int edge[3];
  edge[order.across] = edge[order.down] = kTileEdge;
  edge[order.along] = kTileRow;
  int at[3];
  for (at[0] = 0; at[0] < block.count.x; at[0] += edge[0]) {
    for (at[1] = 0; at[1] < block.count.y; at[1] += edge[1]) {
      for (at[2] = 0; at[2] < block.count.z; at[2] += edge[2]) {
        Tile tile{block.origin + block.spacing * Vec3d(at[0], at[1], at[2]), block.spacing, {}};
        for (int axis = 0; axis < 3; ++axis)
          tile.count[axis] = std::min(edge[axis], block.count[axis] - at[axis]);
        sum_tile<kKind>(tables, octaves, tile, order, sums);
        float* const out = values + size_t(at[0]) * stride[0] + size_t(at[1]) * stride[1] + size_t(at[2]);
        const float* row = sums;
        for (int a = 0; a < tile.count[order.across]; ++a) {
          for (int b = 0; b < tile.count[order.down]; ++b, row += row_stride(tile.count[order.along])) {
            std::copy_n(row, tile.count[order.along],
                        out + size_t(a) * stride[order.across] + size_t(b) * stride[order.down]);
          }
        }
      }
    }
  }
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
