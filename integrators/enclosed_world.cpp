#include "integrators/enclosed_world.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/math/box.h"
#include "lib/math/box_shadow.h"
#include "lib/math/offset_point.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The box in the world around a grid's bounds, larger by what rounding may do.
Box3d world_box(const Box3d& bounds, const Affine& world_from_local) {
  Box3d box = box_around(world_from_local, bounds);
  if (box.isEmpty()) return box;
  const Vec3d margin(surface_error(length(box.min) + length(box.max)));
  return {box.min - margin, box.max + margin};
}

double longest_axis(const Vec3d& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

}  // namespace

EnclosedWorld::EnclosedWorld(const World& world, const EffectPlan& plan, const MarchWorld& march)
    : m_world(world), m_plan(plan), m_march(march), m_shades(world, plan) {
  for (const WorldMedium* medium : march.media()) {
    if (medium->density->has_bricks()) {
      add_curvature(*medium);
      continue;
    }
    m_haze_bounds.extendBy(medium->density->bounds());
    if (medium->extinction > 0.0)
      m_hazes.push_back({medium->extinction, dynamic_cast<const KnownColumns*>(medium->density.get())});
  }
  add_places();
}

void EnclosedWorld::add_curvature(const WorldMedium& medium) {
  Curvature& curvature = m_curvatures.emplace_back();
  if (!m_plan.scattering || !(medium.extinction > 0.0)) return;
  curvature.pyramid = std::make_unique<const BrickPyramid>(*medium.density->bricks());
  curvature.grid = std::make_unique<const CurvatureGrid>(*curvature.pyramid);
}

void EnclosedWorld::add_places() {
  const std::vector<MarchGrid>& grids = m_march.kernel.grids;
  for (size_t g = 0; g < grids.size(); ++g) {
    const Affine& local_from_world = grids[g].local_from_world;
    m_places.push_back({g, local_from_world, world_box(grids[g].bounds, local_from_world.inverse())});
  }
}

double EnclosedWorld::depth(size_t light, const Vec3d& p, FieldCounters& counters) const {
  const Ray ray{p, m_march.suns()[light].wi};
  double tau = 0.0;
  for (const WorldMedium& medium : m_world.media) {
    if (medium.extinction > 0.0)
      tau += medium.extinction * medium.density->column(ray, {0.0, kInfinity}, kInfinity, counters);
  }
  return tau;
}

double EnclosedWorld::depth_variation(size_t light, const Vec3d& middle, const Vec3d& step) const {
  double sum = 0.0;
  for (const Place& place : m_places) {
    if (m_curvatures[place.grid].grid && may_shade(place, light, {middle - 0.5 * step, step}, {0.0, 1.0}))
      sum += depth_variation(place, light, middle, step);
  }
  return sum;
}

double EnclosedWorld::depth_variation(const Place& place, size_t light, const Vec3d& middle,
                                      const Vec3d& step) const {
  const Affine& local = place.local_from_world;
  const Ray line{local.point(middle), local.direction(m_march.suns()[light].wi)};
  return m_march.kernel.grids[place.grid].extinction *
         m_curvatures[place.grid].grid->variation_along(line, local.direction(step));
}

/// Asked for the sake of long steps in hazes.
bool EnclosedWorld::may_shade(const Place& place, size_t light, const Ray& ray, Segment segment) const {
  return m_hazes.empty() || !shadow_of_box(ray, segment, m_march.suns()[light].wi, place.box).empty();
}

double EnclosedWorld::haze_bend(size_t light, const Ray& ray, Segment part) const {
  double sum = 0.0;
  for (const Haze& haze : m_hazes)
    sum += haze.extinction * haze.columns->column_bend(ray, part, m_march.suns()[light].wi);
  return sum;
}

void EnclosedWorld::append_zones(const Ray& ray, Segment segment, std::vector<Zone>& zones) const {
  const Segment in_haze = has_hazes() ? clip_to_box(ray, segment, m_haze_bounds) : Segment{};
  for (const Place& place : m_places) {
    const Affine& local = place.local_from_world;
    const Ray local_ray{local.point(ray.o), local.direction(ray.d)};
    const double cells_per_metre = longest_axis(local_ray.d);
    const Segment inside = clip_to_box(local_ray, segment, m_march.kernel.grids[place.grid].bounds);
    if (!inside.empty()) zones.push_back({inside, cells_per_metre});
    if (in_haze.empty() || !m_curvatures[place.grid].grid) continue;
    for (const Illumination& sun : m_march.suns()) {
      const Segment shadow = shadow_of_box(ray, in_haze, sun.wi, place.box);
      if (!shadow.empty()) zones.push_back({shadow, cells_per_metre});
    }
  }
}

size_t EnclosedWorld::memory_bytes() const {
  size_t sum = 0;
  for (const Curvature& curvature : m_curvatures) sum += curvature.grid ? curvature.grid->memory_bytes() : 0;
  return sum;
}

}  // namespace pileus
