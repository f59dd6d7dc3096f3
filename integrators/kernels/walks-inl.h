// Where rays go: boxes, beams of rays, and the stretches of a grid along a ray.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_WALKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_WALKS_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_WALKS_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_WALKS_INL_H
#endif

#include <algorithm>
#include <limits>
#include <span>

#include "hwy/highway.h"

#include "integrators/kernels/march_kernel.h"
#include "lib/volume/node_walker.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

inline Segment clip_to_bounds(const Box3d& box, const Ray& ray, Segment segment) {
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.d[axis] == 0.0) {
      if (!(ray.o[axis] >= box.min[axis] && ray.o[axis] <= box.max[axis])) return {};
      continue;
    }
    const double inverse = 1.0 / ray.d[axis];
    const double a = (box.min[axis] - ray.o[axis]) * inverse, b = (box.max[axis] - ray.o[axis]) * inverse;
    segment.t0 = std::max(segment.t0, std::min(a, b));
    segment.t1 = std::min(segment.t1, std::max(a, b));
  }
  return segment;
}

inline Ray local_ray(const MarchGrid& grid, const Ray& ray) {
  return {grid.local_from_world.point(ray.o), grid.local_from_world.direction(ray.d)};
}

/// All rays of a tile at once: intervals that hold their origins and directions.
class Beam {
 public:
  Beam(const MarchGrid& grid, std::span<const MarchRay> rays) {
    for (const MarchRay& job : rays) {
      const Ray ray = local_ray(grid, job.ray);
      m_o.extendBy(ray.o);
      m_d.extendBy(ray.d);
    }
  }

  /// True where no ray can meet the box: interval arithmetic on the slabs. Axes along which rays go either
  /// way say nothing.
  bool misses(const Box3d& box) const {
    double enter = 0.0, leave = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      if (!(m_d.min[axis] > 0.0 || m_d.max[axis] < 0.0)) continue;
      const bool is_up = m_d.min[axis] > 0.0;
      const double near = is_up ? box.min[axis] - m_o.max[axis] : m_o.min[axis] - box.max[axis];
      const double far = is_up ? box.max[axis] - m_o.min[axis] : m_o.max[axis] - box.min[axis];
      const double slowest = is_up ? m_d.min[axis] : -m_d.max[axis],
                   fastest = is_up ? m_d.max[axis] : -m_d.min[axis];
      if (far < 0.0) return true;
      enter = std::max(enter, near / fastest);
      leave = std::min(leave, far / slowest);
    }
    return enter > leave * (1.0 + 1e-12);
  }

 private:
  Box3d m_o, m_d;
};

/// The stretches of one grid along a ray.
class GridWalk {
 public:
  /// ray: local; segment: inside the grid's bounds
  GridWalk(const MarchGrid& grid, const Ray& ray, const Segment& segment)
      : m_walker(*grid.pyramid, ray, segment),
        m_whole(grid.pyramid->levels().back().ranges[0]),
        m_extinction(grid.extinction),
        m_voxel(1.0 / length(ray.d)) {
    if (!segment.empty()) now.t0 = now.t1 = segment.t0;
  }

  bool next() { return m_walker.next(now); }

  /// Moves on to the stretch that ends behind t, or to infinity.
  void pass(double t) {
    while (now.t1 <= t) {
      if (!next()) now.t0 = now.t1 = std::numeric_limits<double>::infinity();
    }
  }

  const ValueRange& whole() const { return m_whole; }  ///< of the grid
  double extinction() const { return m_extinction; }
  double voxel() const { return m_voxel; }  ///< length of a voxel's edge along the ray [m]

  NodeWalker::Stretch now{
      std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(), {}};

 private:
  NodeWalker m_walker;
  ValueRange m_whole;
  double m_extinction, m_voxel;
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
