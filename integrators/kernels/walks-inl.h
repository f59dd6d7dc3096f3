// Where rays go: boxes, beams of rays, and what a beam meets of a grid.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_WALKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_WALKS_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_WALKS_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_WALKS_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "hwy/highway.h"

#include "integrators/kernels/march_kernel.h"
#include "lib/math/beam.h"
#include "lib/volume/node_walker.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// What is known of a stretch of the packet's way before anything is sampled.
struct Slab {
  bool is_empty = true, is_uniform = true;
  double sigma = 0.0;      ///< largest extinction [1/m]
  double variation = 0.0;  ///< of what a density adds to a ray, relative to the brightest [1/m]
  double voxel = std::numeric_limits<double>::infinity();  ///< shortest of the grids that are met [m]
  double slope = 0.0;       ///< of the extinction of hazes, or of what they scatter [1/m2]
  double most_rate = 0.0;   ///< more steps than a voxel wants may be worth it: up to so many [1/m]
  double brightness = 1.0;  ///< of the light here, at most, as a share of the brightest on the rays

  /// Two rules give the step: the density may vary so much, and the light inside a step may fall by so much,
  /// that the step errs by its share (METHODS §1.5, §9.2); both matter less behind what the rays have already
  /// met.
  ///   weight: transmittance left, by the quality of steps that is wanted
  int steps(double span, double weight) const {
    constexpr double kMostPerVoxel = 8.0, kMost = 32768.0;
    double rate = std::sqrt(weight * std::max(variation / voxel + slope, sigma * sigma));
    if (std::isfinite(voxel)) rate = std::min(rate, std::max(kMostPerVoxel / voxel, most_rate));
    return std::max(1, int(std::ceil(std::min(span * rate, kMost))));
  }
};

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

/// The rays of a packet as one, seen from a grid.
class GridBeam {
 public:
  /// Also fills `locals`, ray by ray; it must outlive the beam.
  GridBeam(const MarchGrid& grid, const Affine& local_from_world, std::span<const MarchRay> rays,
           std::span<Ray> locals)
      : m_pyramid(grid.pyramid), m_bounds(grid.bounds), m_rays(locals.first(rays.size())) {
    double longest2 = 0.0;
    for (size_t i = 0; i < rays.size(); ++i) {
      const Ray& ray = rays[i].ray;
      const bool has_new_origin = i == 0 || ray.o != rays[i - 1].ray.o;
      locals[i].o = has_new_origin ? local_from_world.point(ray.o) : locals[i - 1].o;
      locals[i].d = local_from_world.direction(ray.d);
      if (has_new_origin) m_beam.o.extendBy(locals[i].o);
      m_beam.d.extendBy(locals[i].d);
      longest2 = std::max(longest2, dot(locals[i].d, locals[i].d));
    }
    m_voxel = 1.0 / std::sqrt(longest2);
  }

  /// Where rays may be in the grid's bounds.
  Segment inside() const {
    const Segment inside = m_beam.inside(m_bounds);
    // Rays that part as they go leave the box long before their intervals do.
    return inside.empty() || inside.length() <= 2.0 * length(m_bounds.size()) * m_voxel ? inside
                                                                                        : hull_of_rays();
  }

  /// Length along the rays in which none moves by more than a voxel's edge [m].
  double voxel() const { return m_voxel; }

  /// Range of the densities that rays can meet between t0 and t1.
  ValueRange range(double t0, double t1) const {
    const Box3d box = m_beam.box(t0, t1);
    for (int axis = 0; axis < 3; ++axis)
      if (!(box.max[axis] > m_bounds.min[axis]) || !(box.min[axis] < m_bounds.max[axis])) return {};
    return m_pyramid->range(box);
  }

  const ValueRange& whole() const { return m_pyramid->levels().back().ranges[0]; }  ///< of the grid

 private:
  Segment hull_of_rays() const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Segment hull{kInfinity, 0.0};
    for (const Ray& ray : m_rays) {
      const Segment inside = clip_to_bounds(m_bounds, ray, {0.0, kInfinity});
      if (inside.empty()) continue;
      hull = {std::min(hull.t0, inside.t0), std::max(hull.t1, inside.t1)};
    }
    return hull;
  }

  const BrickPyramid* m_pyramid;
  Box3d m_bounds;               ///< of what is not 0, local
  std::span<const Ray> m_rays;  ///< local
  Beam m_beam;                  ///< local
  double m_voxel;
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
