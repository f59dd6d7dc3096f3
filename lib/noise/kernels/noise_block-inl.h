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

#include "lib/noise/kernels/gradients-inl.h"
#include "lib/noise/kernels/lattice_axis-inl.h"
#include "lib/noise/kernels/noise_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Noise in a block is linear in each corner's gradient, and so can be summed axis by axis (across, down and
// along; "along" is the axis of the rows, whose points are the lanes):
//   1. lattice:  the gradients of the lattice points that the block needs
//   2. across:   for one plane of points, the two lattice planes beside it are mixed
//   3. along:    mixed lattice rows become rows of points, still on lattice lines of the third axis:
//                ramp P without, and slope Q along, that third axis
//   4. down:     for each row of points two lattice rows are mixed: three multiply-adds per vector of points
// Steps 1 to 3 are shared by many points, because voxels are smaller than cells. Derivatives go through the
// same steps, with a weight's derivative in place of the weight.
//
// Cost in instructions of AVX2 per point and octave, 8^3 points (callgrind): 10 where they are 0.02 lattice
// units apart, 17 at 0.5, 111 at 1.5; about 1.2 are step 4.

constexpr int kTileEdge = 8;  ///< points of a tile across and down
constexpr int kTileRow = 64;  ///< and along
constexpr int kMaxDownLines = LatticeAxis<kTileEdge>::kMaxLines;
constexpr int kMaxRowLines = LatticeAxis<kTileRow>::kMaxLines;

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

constexpr int kTileFloats = kTileEdge * kTileEdge * kTileRow;

/// Floats of a tile in use.
inline int tile_floats(const Tile& tile, const AxisOrder& order) {
  return tile.count[order.across] * tile.count[order.down] * padded(tile.count[order.along]);
}

/// Half the spacing in lattice units, rounded up by what coordinates and single precision may be off.
inline double half_edge(const NoiseOctave& octave, const Tile& tile) {
  double reach = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double extent = tile.spacing * double(tile.count[axis]);
    reach = std::max(
        reach, octave.frequency * (std::fabs(tile.origin[axis]) + extent) + std::fabs(octave.shift[axis]));
  }
  return 0.500001 * octave.frequency * tile.spacing + 1e-15 * reach;
}

/// One octave over one tile.
template <bool kGradient>
class OctaveTile {
 public:
  OctaveTile(const NoiseTables& tables, const NoiseOctave& octave, const Tile& tile, const AxisOrder& order)
      : m_tables(tables),
        m_order(order),
        m_turn(octave.variant.turn),
        m_across(axis<kTileEdge>(octave, tile, order.across)),
        m_down(axis<kTileEdge>(octave, tile, order.down)),
        m_along(axis<kTileRow>(octave, tile, order.along)),
        m_rows(m_down.lines * m_along.lines),
        m_stride(padded(m_along.points)) {}

  /// take(offset of the points in [across][down][along], in rows of whole vectors, scale * noise), and with
  /// kGradient the derivatives along `across`, `down` and `along` behind that.
  template <class Take>
  void visit(float scale, const Take& take) {
    for (int a = 0; a < m_across.points; ++a) {
      mix_across(a, scale);
      m_along.upper_offset == 1 ? expand_rows<true>() : expand_rows<false>();
      mix_down(take, a * m_down.points * m_stride);
    }
  }

 private:
  template <int kMaxPoints>
  static LatticeAxis<kMaxPoints> axis(const NoiseOctave& octave, const Tile& tile, int axis) {
    return {tile.origin[axis] * octave.frequency + octave.shift[axis], tile.spacing * octave.frequency,
            tile.count[axis], octave.variant.period[axis]};
  }

  /// Fills a slot with the components (across, down, along) of the gradients on one lattice plane.
  void load_plane(int line, int slot) {
    m_loaded[slot] = line;
    const D d;
    const bool turns = m_turn.share > 0;
    number_gradients(line, m_tables.gradient[m_turn.from].data(), m_numbers[0]);
    if (turns) number_gradients(line, m_tables.gradient[m_turn.to].data(), m_numbers[1]);
    const V share = hn::Set(d, m_turn.share);
    const int axes[3] = {m_order.across, m_order.down, m_order.along};
    for (int i = 0; i < m_rows; i += kLanes) {
      const auto pick = gradient_pick(m_numbers[0] + i);
      for (int c = 0; c < 3; ++c) hn::Store(doubled_gradient(axes[c], pick), d, m_gradient[slot][c] + i);
      if (!turns) continue;
      const auto pick_to = gradient_pick(m_numbers[1] + i);
      for (int c = 0; c < 3; ++c) {
        float* const at = m_gradient[slot][c] + i;
        const V from = hn::Load(d, at);
        hn::Store(hn::MulAdd(share, hn::Sub(doubled_gradient(axes[c], pick_to), from), from), d, at);
      }
    }
  }

  /// out[down][along]: numbers of the gradients on the lattice plane `line` across.
  void number_gradients(int line, const uint8_t* gradient, uint8_t* out) const {
    const uint8_t* const hash = m_tables.hash.data();
    for (int j = 0; j < m_down.lines; ++j, out += m_along.lines) {
      if (m_order.along == 2) {  // x across, y down
        const uint8_t* const row = gradient + hash[hash[m_across.hash[line]] + m_down.hash[j]];
        if (m_along.is_run) {
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

  /// m_mixed: the lattice planes beside point a, weighted: ramp across, slope down, slope along; the
  /// derivatives of all three across behind them.
  void mix_across(int a, float scale) {
    const int near_line = m_across.lower[a], far_line = near_line + m_across.upper_offset;
    if (m_loaded[m_near] != near_line) {
      if (m_loaded[1 - m_near] == near_line) {  // one cell further
        m_near = 1 - m_near;
      } else {
        load_plane(near_line, m_near);
      }
    }
    if (m_loaded[1 - m_near] != far_line) load_plane(far_line, 1 - m_near);
    const auto& near = m_gradient[m_near];
    const auto& far = m_gradient[1 - m_near];
    const D d;
    const float half = 0.5f * scale;  // the gradients in store are doubled
    const float near_weight = half * (1.0f - m_across.weight[a]), far_weight = half * m_across.weight[a];
    const float near_way = m_across.place[a], far_way = near_way - 1.0f;
    const float growth = half * m_across.weight_slope[a];
    const auto mix = [&](int to, int c, float near_factor, float far_factor) HWY_ATTR {
      const V w0 = hn::Set(d, near_factor), w1 = hn::Set(d, far_factor);
      for (int i = 0; i < m_rows; i += kLanes) {
        const V sum = hn::MulAdd(w1, hn::Load(d, far[c] + i), hn::Mul(w0, hn::Load(d, near[c] + i)));
        hn::Store(sum, d, m_mixed[to] + i);
      }
    };
    mix(0, 0, near_weight * near_way, far_weight * far_way);
    mix(1, 1, near_weight, far_weight);
    mix(2, 2, near_weight, far_weight);
    if constexpr (kGradient) {
      mix(3, 0, near_weight - growth * near_way, far_weight + growth * far_way);
      mix(4, 1, -growth, growth);
      mix(5, 2, -growth, growth);
    }
  }

  /// Where the points of one vector lie along their row, and how their lines' values are found: with kShared
  /// lines by a table look-up in one vector, else they stand there in the order of the points.
  template <bool kShared>
  struct Places {
    using Indices = decltype(hn::IndicesFromVec(D(), hn::Zero(hn::RebindToSigned<D>())));

    V place, back, weight, weight_slope;
    int lower, upper;  ///< the first line's, in a row of m_mixed
    Indices pick_lower, pick_upper;

    HWY_INLINE Places(const LatticeAxis<kTileRow>& axis, int v)
        : place(hn::Load(D(), axis.place + v)),
          back(hn::Sub(place, hn::Set(D(), 1.0f))),
          weight(hn::Load(D(), axis.weight + v)),
          weight_slope(hn::Load(D(), axis.weight_slope + v)),
          lower(axis.lower[v]),
          upper(lower + axis.upper_offset) {
      const hn::RebindToSigned<D> di;
      if constexpr (kShared) {
        const auto index = hn::Sub(hn::LoadU(di, axis.lower + v), hn::Set(di, lower));
        pick_lower = hn::IndicesFromVec(D(), index);
        pick_upper = hn::IndicesFromVec(D(), hn::Add(index, hn::Set(di, 1)));
      }
    }
    HWY_INLINE void look_up(const float* row, V& below, V& above) const {
      const D d;
      const V values = hn::LoadU(d, row + lower);
      below = kShared ? hn::TableLookupLanes(values, pick_lower) : values;
      above = kShared ? hn::TableLookupLanes(values, pick_upper) : hn::LoadU(d, row + upper);
    }
  };

  /// m_ramp, m_slope: values along the rows of points on each lattice line down; behind them their
  /// derivatives along and across.
  template <bool kShared>
  void expand_rows() {
    for (int v = 0; v < m_along.points; v += kLanes) {
      const Places<kShared> at(m_along, v);
      for (int j = 0; j < m_down.lines; ++j) {
        expand_row<kGradient>(at, j, v, 0, 0);
        if constexpr (kGradient) expand_row<false>(at, j, v, 3, 2);
      }
    }
  }

  /// From m_mixed[from .. from + 2] to m_ramp[to] and m_slope[to]; with kAlong their derivatives to [to + 1].
  template <bool kAlong, class At>
  HWY_INLINE void expand_row(const At& at, int j, int v, int from, int to) {
    const D d;
    const int row = j * m_along.lines;
    V ramp0, ramp1, slope0, slope1, along0, along1;
    at.look_up(m_mixed[from] + row, ramp0, ramp1);
    at.look_up(m_mixed[from + 1] + row, slope0, slope1);
    at.look_up(m_mixed[from + 2] + row, along0, along1);
    ramp0 = hn::MulAdd(along0, at.place, ramp0);
    ramp1 = hn::MulAdd(along1, at.back, ramp1);
    const V ramp_step = hn::Sub(ramp1, ramp0), slope_step = hn::Sub(slope1, slope0);
    hn::Store(hn::MulAdd(at.weight, ramp_step, ramp0), d, m_ramp[to][j] + v);
    hn::Store(hn::MulAdd(at.weight, slope_step, slope0), d, m_slope[to][j] + v);
    if constexpr (kAlong) {
      const V along = hn::MulAdd(at.weight, hn::Sub(along1, along0), along0);
      hn::Store(hn::MulAdd(at.weight_slope, ramp_step, along), d, m_ramp[to + 1][j] + v);
      hn::Store(hn::Mul(at.weight_slope, slope_step), d, m_slope[to + 1][j] + v);
    }
  }

  /// Two neighbouring lines down, as what their mix is made of: lerp(w, P0 + Q0 y, P1 + Q1 (y - 1)) with the
  /// differences of both taken once.
  struct LinePair {
    V ramp, slope, step, slope_step;

    HWY_INLINE LinePair(const float* ramps, const float* slopes, int to_upper) {
      const D d;
      ramp = hn::Load(d, ramps), slope = hn::Load(d, slopes);
      const V slope1 = hn::Load(d, slopes + to_upper);
      step = hn::Sub(hn::Sub(hn::Load(d, ramps + to_upper), slope1), ramp);
      slope_step = hn::Sub(slope1, slope);
    }
    HWY_INLINE V mix(V place, V weight) const {
      return hn::MulAdd(weight, difference(place), hn::MulAdd(place, slope, ramp));
    }
    HWY_INLINE V mix_slope(V place, V weight, V weight_slope) const {
      return hn::MulAdd(weight_slope, difference(place), hn::MulAdd(weight, slope_step, slope));
    }

   private:
    HWY_INLINE V difference(V place) const { return hn::MulAdd(place, slope_step, step); }
  };

  template <class Take>
  void mix_down(const Take& take, int plane) const {
    const D d;
    const int to_upper = m_down.upper_offset * kTileRow;
    for (int b = 0; b < m_down.points;) {
      const int line = m_down.lower[b];
      int end = b + 1;
      while (end < m_down.points && m_down.lower[end] == line) ++end;
      for (int i = 0; i < m_along.points; i += kLanes) {
        const auto pair = [&](int c) HWY_ATTR {
          return LinePair(m_ramp[c][line] + i, m_slope[c][line] + i, to_upper);
        };
        const LinePair value = pair(0);
        if constexpr (kGradient) {
          const LinePair along = pair(1), across = pair(2);
          for (int m = b; m < end; ++m) {
            const V place = hn::Set(d, m_down.place[m]), weight = hn::Set(d, m_down.weight[m]);
            take(plane + m * m_stride + i, value.mix(place, weight), across.mix(place, weight),
                 value.mix_slope(place, weight, hn::Set(d, m_down.weight_slope[m])),
                 along.mix(place, weight));
          }
        } else {
          for (int m = b; m < end; ++m) {
            const V place = hn::Set(d, m_down.place[m]), weight = hn::Set(d, m_down.weight[m]);
            take(plane + m * m_stride + i, value.mix(place, weight));
          }
        }
      }
      b = end;
    }
  }

  const NoiseTables& m_tables;
  const AxisOrder m_order;
  const NoiseTurn m_turn;
  const LatticeAxis<kTileEdge> m_across, m_down;
  const LatticeAxis<kTileRow> m_along;
  const int m_rows;            ///< lattice points of a plane: rows of m_along.lines, one after another
  const int m_stride;          ///< floats from one row of points to the next
  int m_loaded[2] = {-1, -1};  ///< lattice planes in the slots of m_gradient
  int m_near = 0;              ///< slot of the nearer one
  // Loads of whole vectors run over the end of what is used.
  static constexpr int kPlane = kMaxDownLines * kMaxRowLines + 16;
  static constexpr int kMixes = kGradient ? 6 : 3, kExpansions = kGradient ? 3 : 1;
  uint8_t m_numbers[2][kPlane];
  alignas(64) float m_gradient[2][3][kPlane];
  alignas(64) float m_mixed[kMixes][kPlane];
  alignas(64) float m_ramp[kExpansions][kMaxDownLines][kTileRow];
  alignas(64) float m_slope[kExpansions][kMaxDownLines][kTileRow];
};

/// Cuts a block into tiles: for_tile(tile, order, index of its first point in arrays over the block).
template <class ForTile>
void for_each_tile(const NoiseBlock& block, const ForTile& for_tile) {
  const AxisOrder order = axis_order(block.count);
  int edge[3];
  edge[order.across] = edge[order.down] = kTileEdge;
  edge[order.along] = kTileRow;
  int at[3];
  for (at[0] = 0; at[0] < block.count.x; at[0] += edge[0]) {
    for (at[1] = 0; at[1] < block.count.y; at[1] += edge[1]) {
      for (at[2] = 0; at[2] < block.count.z; at[2] += edge[2]) {
        Tile tile{block.origin + block.spacing * Vec3d(at[0], at[1], at[2]), block.spacing, {}};
        for (int axis = 0; axis < 3; ++axis) {
          tile.count[axis] = std::min(edge[axis], block.count[axis] - at[axis]);
        }
        for_tile(
            tile, order,
            (size_t(at[0]) * size_t(block.count.y) + size_t(at[1])) * size_t(block.count.z) + size_t(at[2]));
      }
    }
  }
}

/// put(index in the block, index in the tile's [across][down][along], number of points) for each row of a
/// tile; for all at once where the block is a tile of whole vectors.
template <class Put>
void for_each_row(const NoiseBlock& block, const Tile& tile, const AxisOrder& order, size_t first,
                  const Put& put) {
  const int along = tile.count[order.along];
  const bool is_all =
      tile.count[0] == block.count.x && tile.count[1] == block.count.y && tile.count[2] == block.count.z;
  if (is_all && along % kLanes == 0) return put(first, 0, int(block.size()));
  const size_t stride[3] = {size_t(block.count.y) * size_t(block.count.z), size_t(block.count.z), 1};
  int row = 0;
  for (int a = 0; a < tile.count[order.across]; ++a) {
    for (int b = 0; b < tile.count[order.down]; ++b, row += padded(along)) {
      put(first + size_t(a) * stride[order.across] + size_t(b) * stride[order.down], row, along);
    }
  }
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
