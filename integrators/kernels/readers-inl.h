// What the march reads of grids: densities, a vector of positions at a time.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_READERS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_READERS_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_READERS_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_READERS_INL_H
#endif

#include <cmath>
#include <cstdint>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/march_kernel.h"
#include "lib/simd/trilinear-inl.h"
#include "lib/simd/truncate-inl.h"
#include "lib/volume/quantized_bricks.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
constexpr size_t kLanes = hn::MaxLanes(D());

/// Positions along a ray in some space, o + t * d, for a whole vector of t.
struct LinePath {
  float o[3], d[3];

  LinePath() = default;
  LinePath(const Vec3d& origin, const Vec3d& direction) {
    for (int axis = 0; axis < 3; ++axis) o[axis] = float(origin[axis]), d[axis] = float(direction[axis]);
  }
  HWY_INLINE V at(int axis, V t) const {
    const D tag;
    return hn::MulAdd(t, hn::Set(tag, d[axis]), hn::Set(tag, o[axis]));
  }
};

/// Densities of a grid, by way of the table of bricks; of 16-bit values or of floats.
class GridReader {
 public:
  explicit GridReader(const BrickPyramid& pyramid) : m_offsets(pyramid.offsets().data()) {
    if (const QuantizedValues* quantized = pyramid.quantized()) {
      m_stored = quantized->stored.get();
      m_scale = float(quantized->scale / double(kQuantizedStep));
    } else {
      m_values = pyramid.grid().all_values().data();
    }
    const Vec3i n = pyramid.levels().front().nodes;
    m_stride_x = n.y * n.z;
    m_stride_y = n.z;
    for (int axis = 0; axis < 3; ++axis) m_last[axis] = 8.0f * float(n[axis]) - 1.0f;
  }

  /// Where the densities of a vector of positions are, and what is left of these in their cells. Finding that
  /// and reading there are steps of their own, so that those of several vectors can be under way together:
  /// one waits for the other.
  struct Cells {
    alignas(64) int32_t bricks[kLanes];   ///< in the table
    alignas(64) int32_t corners[kLanes];  ///< among a brick's values
    V fx, fy, fz;
  };

  /// kClamp: where positions may lie far outside. Rounding alone never leaves the table's border of zeros.
  template <bool kClamp>
  HWY_INLINE Cells locate(V x, V y, V z) const {
    if constexpr (kClamp) clamp(x, y, z);
    const DI di;
    const Place place(x, y, z);
    Cells cells;
    hn::Store(brick_of(place), di, cells.bricks);
    hn::Store(place.corner(), di, cells.corners);
    cells.fx = place.fx, cells.fy = place.fy, cells.fz = place.fz;
    return cells;
  }

  /// Asks memory for 16-bit values. Lanes are neighbours: what every fifth needs is nearly all of it.
  HWY_INLINE void prefetch(const Cells& cells) const {
    if (!m_stored) return;
    for (size_t i = 0; i < kLanes; i += 5) {
      const int16_t* const at = m_stored + uint32_t(m_offsets[uint32_t(cells.bricks[i])] + cells.corners[i]);
      __builtin_prefetch(at);
      __builtin_prefetch(at + BrickGrid::kStrideX);
    }
  }

  HWY_INLINE V read(const Cells& cells) const {
    return m_stored ? read_quantized<false>(cells) : read_floats<false>(cells);
  }

  template <bool kClamp>
  HWY_INLINE V read(V x, V y, V z) const {
    return read(locate<kClamp>(x, y, z));
  }

  /// The same for positions of which many lie in empty bricks or outside.
  HWY_INLINE V read_or_skip(V x, V y, V z) const {
    const Cells cells = locate<true>(x, y, z);
    return m_stored ? read_quantized<true>(cells) : read_floats<true>(cells);
  }

 private:
  HWY_INLINE void clamp(V& x, V& y, V& z) const {
    const D d;
    x = hn::Max(hn::Zero(d), hn::Min(x, hn::Set(d, m_last[0])));
    y = hn::Max(hn::Zero(d), hn::Min(y, hn::Set(d, m_last[1])));
    z = hn::Max(hn::Zero(d), hn::Min(z, hn::Set(d, m_last[2])));
  }

  /// Positions as cells, and what is left in the cell.
  struct Place {
    HWY_INLINE Place(V x, V y, V z) {
      const D d;
      ix = truncate_small(x), iy = truncate_small(y), iz = truncate_small(z);
      fx = hn::Sub(x, hn::ConvertTo(d, ix));
      fy = hn::Sub(y, hn::ConvertTo(d, iy));
      fz = hn::Sub(z, hn::ConvertTo(d, iz));
    }
    /// Index of the lowest corner among a brick's values.
    HWY_INLINE VI corner() const {
      const DI di;
      const VI seven = hn::Set(di, 7);
      return hn::Add(hn::Add(hn::Mul(hn::And(ix, seven), hn::Set(di, BrickGrid::kStrideX)),
                             hn::Mul(hn::And(iy, seven), hn::Set(di, BrickGrid::kStrideY))),
                     hn::And(iz, seven));
    }

    VI ix, iy, iz;
    V fx, fy, fz;
  };

  /// Index of the brick in the table.
  HWY_INLINE VI brick_of(const Place& at) const {
    const DI di;
    return hn::Add(hn::Add(hn::Mul(hn::ShiftRight<3>(at.ix), hn::Set(di, m_stride_x)),
                           hn::Mul(hn::ShiftRight<3>(at.iy), hn::Set(di, m_stride_y))),
                   hn::ShiftRight<3>(at.iz));
  }

  template <bool kSkip>
  HWY_INLINE V read_quantized(const Cells& cells) const {
    const D d;
    const int16_t* at[kLanes];
    int32_t any = 0;
    for (size_t i = 0; i < kLanes; ++i) {
      const int32_t offset = m_offsets[uint32_t(cells.bricks[i])];
      any |= offset;
      at[i] = m_stored + uint32_t(offset + cells.corners[i]);  // unsigned, as that needs no sign
    }
    if (kSkip && any == 0) return hn::Zero(d);
    const V steps =
        trilinear_quantized(d, at, BrickGrid::kStrideX, BrickGrid::kStrideY, cells.fx, cells.fy, cells.fz);
    return hn::Mul(steps, hn::Set(d, m_scale));
  }

  template <bool kSkip>
  HWY_INLINE V read_floats(const Cells& cells) const {
    const D d;
    const DI di;
    const VI brick = hn::GatherIndex(di, m_offsets, hn::Load(di, cells.bricks));
    if (kSkip && hn::AllTrue(di, hn::Eq(brick, hn::Zero(di)))) return hn::Zero(d);
    return trilinear(d, m_values, hn::Add(brick, hn::Load(di, cells.corners)), BrickGrid::kStrideX,
                     BrickGrid::kStrideY, cells.fx, cells.fy, cells.fz);
  }

  const int32_t* m_offsets;
  const int16_t* m_stored = nullptr;  ///< 16-bit values, or
  const float* m_values = nullptr;
  float m_scale = 1.0f;
  int m_stride_x, m_stride_y;  ///< of the table
  float m_last[3];             ///< largest position that still has a cell
};

inline std::vector<GridReader> grid_readers(const MarchScene& scene) {
  std::vector<GridReader> readers;
  for (const MarchGrid& grid : scene.grids) readers.emplace_back(*grid.pyramid);
  return readers;
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
