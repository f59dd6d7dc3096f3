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

#include "hwy/highway.h"

#include "integrators/kernels/march_kernel.h"
#include "lib/simd/trilinear-inl.h"

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

/// Densities of a grid, by way of the table of bricks.
class GridReader {
 public:
  explicit GridReader(const BrickPyramid& pyramid)
      : values(pyramid.grid().all_values().data()), offsets(pyramid.offsets().data()) {
    const Vec3i n = pyramid.levels().front().nodes;
    stride_x = n.y * n.z;
    stride_y = n.z;
    for (int axis = 0; axis < 3; ++axis) last[axis] = 8.0f * float(n[axis]) - 1.0f;
  }

  /// kClamp: where positions may lie far outside. Rounding alone never leaves the table's border of zeros.
  template <bool kClamp>
  HWY_INLINE V read(V x, V y, V z) const {
    if constexpr (kClamp) clamp(x, y, z);
    return interpolate(brick_of(x, y, z), x, y, z);
  }

  /// The same for positions of which many lie in empty bricks or outside.
  HWY_INLINE V read_or_skip(V x, V y, V z) const {
    const D d;
    const DI di;
    clamp(x, y, z);
    const VI brick = brick_of(x, y, z);
    if (hn::AllTrue(di, hn::Eq(brick, hn::Zero(di)))) return hn::Zero(d);
    return interpolate(brick, x, y, z);
  }

 private:
  HWY_INLINE void clamp(V& x, V& y, V& z) const {
    const D d;
    x = hn::Max(hn::Zero(d), hn::Min(x, hn::Set(d, last[0])));
    y = hn::Max(hn::Zero(d), hn::Min(y, hn::Set(d, last[1])));
    z = hn::Max(hn::Zero(d), hn::Min(z, hn::Set(d, last[2])));
  }

  /// Where the values of the bricks begin.
  HWY_INLINE VI brick_of(V x, V y, V z) const {
    const DI di;
    const VI ix = hn::ShiftRight<3>(hn::ConvertTo(di, x)), iy = hn::ShiftRight<3>(hn::ConvertTo(di, y)),
             iz = hn::ShiftRight<3>(hn::ConvertTo(di, z));
    const VI index =
        hn::Add(hn::Add(hn::Mul(ix, hn::Set(di, stride_x)), hn::Mul(iy, hn::Set(di, stride_y))), iz);
    return hn::GatherIndex(di, offsets, index);
  }

  HWY_INLINE V interpolate(VI brick, V x, V y, V z) const {
    const D d;
    const DI di;
    const VI ix = hn::ConvertTo(di, x), iy = hn::ConvertTo(di, y), iz = hn::ConvertTo(di, z);
    const VI seven = hn::Set(di, 7);
    const VI cell = hn::Add(hn::Add(hn::Mul(hn::And(ix, seven), hn::Set(di, BrickGrid::kStrideX)),
                                    hn::Mul(hn::And(iy, seven), hn::Set(di, BrickGrid::kStrideY))),
                            hn::And(iz, seven));
    return trilinear(d, values, hn::Add(brick, cell), BrickGrid::kStrideX, BrickGrid::kStrideY,
                     hn::Sub(x, hn::ConvertTo(d, ix)), hn::Sub(y, hn::ConvertTo(d, iy)),
                     hn::Sub(z, hn::ConvertTo(d, iz)));
  }

  const float* values;
  const int32_t* offsets;
  int stride_x, stride_y;  ///< of the table
  float last[3];           ///< largest position that still has a cell
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
