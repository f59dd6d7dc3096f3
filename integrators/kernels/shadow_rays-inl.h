// Shadow rays, where no lattice holds the depths.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_SHADOW_RAYS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_SHADOW_RAYS_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_SHADOW_RAYS_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_SHADOW_RAYS_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "hwy/highway.h"

#include "integrators/kernels/readers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

struct ShadowRays {
  Vec3d towards;  ///< the sun, local to the grid, of a unit vector of the world
  double step;    ///< [cells]
  double enough;  ///< optical depth at which they may end
};

/// Optical depth of a grid from points (x, y, z), local, towards a sun: the rays of all lanes in step.
inline V trace_shadow(const MarchGrid& grid, const GridReader& reader, const ShadowRays& rays, V x, V y, V z,
                      uint64_t& lookups) {
  const D d;
  const double ds = rays.step / length(rays.towards);  // [m]
  const V p[3] = {x, y, z};
  V step[3];
  V most = hn::Set(d, std::numeric_limits<float>::max());  // steps until a lane leaves the grid
  for (int axis = 0; axis < 3; ++axis) {
    const float per_step = float(rays.towards[axis] * ds);
    step[axis] = hn::Set(d, per_step);
    if (per_step == 0.0f) continue;
    const V exit = hn::Set(d, float(per_step > 0.0f ? grid.bounds.max[axis] : grid.bounds.min[axis]));
    most = hn::Min(most, hn::Div(hn::Sub(exit, p[axis]), step[axis]));
  }
  const float scale = float(grid.extinction * ds);
  const V enough = hn::Set(d, float(rays.enough) / scale);
  const int count = int(std::clamp(hn::GetLane(hn::MaxOfLanes(d, most)), 0.0f, 1e7f)) + 1;
  V sum = hn::Zero(d);
  int k = 0;
  for (; k < count; ++k) {
    const V at = hn::Set(d, float(k) + 0.5f);
    sum = hn::Add(sum, reader.read_or_skip(hn::MulAdd(at, step[0], p[0]), hn::MulAdd(at, step[1], p[1]),
                                           hn::MulAdd(at, step[2], p[2])));
    if (k % 8 == 7 && hn::AllTrue(d, hn::Ge(sum, enough))) break;
  }
  lookups += uint64_t(k) * kLanes;
  return hn::Mul(sum, hn::Set(d, scale));
}

struct LampRays {
  Vec3d lamp;     ///< local to the grid
  double step;    ///< [cells]
  double enough;  ///< optical depth at which they may end
};

/// Optical depth of a grid from points (x, y, z), local, to a lamp: the ray of each lane in as many steps.
///   distance: of the lamp [m]
inline V trace_to_lamp(const MarchGrid& grid, const GridReader& reader, const LampRays& rays, V x, V y, V z,
                       V distance, uint64_t& lookups) {
  const D d;
  const V p[3] = {x, y, z}, tiny = hn::Set(d, 1e-12f);
  V way[3], cells2 = hn::Zero(d);
  V from = hn::Zero(d), to = hn::Set(d, 1.0f);  // of the way, inside the grid
  for (int axis = 0; axis < 3; ++axis) {
    way[axis] = hn::Sub(hn::Set(d, float(rays.lamp[axis])), p[axis]);
    cells2 = hn::MulAdd(way[axis], way[axis], cells2);
    const V safe = hn::IfThenElse(hn::Lt(hn::Abs(way[axis]), tiny), tiny, way[axis]);
    const V a = hn::Div(hn::Sub(hn::Set(d, float(grid.bounds.min[axis])), p[axis]), safe),
            b = hn::Div(hn::Sub(hn::Set(d, float(grid.bounds.max[axis])), p[axis]), safe);
    from = hn::Max(from, hn::Min(a, b));
    to = hn::Min(to, hn::Max(a, b));
  }
  const V share = hn::Max(hn::Sub(to, from), hn::Zero(d));
  const V steps = hn::Mul(hn::Mul(hn::Sqrt(cells2), share), hn::Set(d, float(1.0 / rays.step)));
  const int count = int(std::ceil(std::clamp(hn::GetLane(hn::MaxOfLanes(d, steps)), 0.0f, 1e7f)));
  if (count == 0) return hn::Zero(d);
  const V ds = hn::Mul(share, hn::Set(d, 1.0f / float(count)));
  const V scale = hn::Mul(hn::Mul(ds, distance), hn::Set(d, float(grid.extinction)));
  const V enough = hn::Set(d, float(rays.enough));
  V sum = hn::Zero(d);
  int k = 0;
  for (; k < count; ++k) {
    const V at = hn::MulAdd(hn::Set(d, float(k) + 0.5f), ds, from);
    sum = hn::Add(sum, reader.read_or_skip(hn::MulAdd(at, way[0], p[0]), hn::MulAdd(at, way[1], p[1]),
                                           hn::MulAdd(at, way[2], p[2])));
    if (k % 8 == 7 && hn::AllTrue(d, hn::Or(hn::Ge(hn::Mul(sum, scale), enough), hn::Le(share, hn::Zero(d)))))
      break;
  }
  lookups += uint64_t(k) * kLanes;
  return hn::Mul(sum, scale);
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
