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
    if (medium->density->has_bricks()) continue;
    m_haze_bounds.extendBy(medium->density->bounds());
    if (medium->extinction > 0.0)
      m_hazes.push_back({medium->extinction, dynamic_cast<const KnownColumns*>(medium->density.get())});
  }
  add_places();
}

/// Made once, whatever stands in how many places.
const CurvatureGrid* EnclosedWorld::curvature_of(const WorldMedium& medium) {
  if (!m_plan.scattering || !(medium.extinction > 0.0)) return nullptr;
  const BrickGrid& bricks = *medium.density->bricks();
  Curvature& curvature = m_curvatures[&bricks];
  if (!curvature.grid) {
    curvature.pyramid = std::make_unique<const BrickPyramid>(bricks);
    curvature.grid = std::make_unique<const CurvatureGrid>(*curvature.pyramid);
  }
  return curvature.grid.get();
}

void EnclosedWorld::add_places() {
  const MarchScene& scene = m_march.kernel;
  if (scene.places.empty()) {
    for (size_t g = 0; g < scene.grids.size(); ++g) add_place(g, scene.grids[g].local_from_world);
  } else {
    for (const MarchPlace& place : scene.places) add_place(place.grid, place.local_from_world);
  }
  std::vector<Box3d> boxes;
  for (const Place& place : m_places) {
    const Box3d& bounds = scene.grids[place.grid].bounds;
    const Vec3d layer(1.0);  // values that are not 0 bend the cells around them
    const bool is_empty = bounds.isEmpty();
    const Box3d bent = is_empty ? bounds : Box3d(bounds.min - layer, bounds.max + layer);
    const Box3d box = world_box(bent, place.local_from_world.inverse());
    const Vec3d margin(0.5 * m_longest_step);
    boxes.push_back(is_empty ? box : Box3d(box.min - margin, box.max + margin));
  }
  m_index = BoxIndex(boxes);
}

void EnclosedWorld::add_place(size_t grid, const Affine& local_from_world) {
  const Affine world_from_local = local_from_world.inverse();
  const Box3d box = world_box(m_march.kernel.grids[grid].bounds, world_from_local);
  m_places.push_back({grid, curvature_of(*m_march.media()[grid]), local_from_world, box});
  double diagonal = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d edge(0.0);
    edge[axis] = 1.0;
    diagonal += length(world_from_local.direction(edge));
  }
  m_longest_step = std::max(m_longest_step, diagonal);
}

/// Those that the ray meets, or that one meets which is not farther from it than half the longest step; in
/// the order of their numbers.
template <class Visit>
void EnclosedWorld::for_places_on(const Ray& ray, const Visit& visit) const {
  thread_local std::vector<size_t> numbers;
  numbers.clear();
  m_index.visit(ray, {0.0, kInfinity}, [](size_t place, double&) { return numbers.push_back(place), true; });
  std::sort(numbers.begin(), numbers.end());
  for (const size_t number : numbers) visit(m_places[number]);
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
  const auto add = [&](const Place& place) {
    if (place.curvature && may_shade(place, light, {middle - 0.5 * step, step}, {0.0, 1.0}))
      sum += depth_variation(place, light, middle, step);
  };
  if (length(step) <= m_longest_step) {
    for_places_on({middle, m_march.suns()[light].wi}, add);
  } else {
    for (const Place& place : m_places) add(place);
  }
  return sum;
}

double EnclosedWorld::depth_variation(const Place& place, size_t light, const Vec3d& middle,
                                      const Vec3d& step) const {
  const Affine& local = place.local_from_world;
  const Ray line{local.point(middle), local.direction(m_march.suns()[light].wi)};
  return m_march.kernel.grids[place.grid].extinction *
         place.curvature->variation_along(line, local.direction(step));
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
  const auto add = [&](const Place& place) {
    const Affine& local = place.local_from_world;
    const Ray local_ray{local.point(ray.o), local.direction(ray.d)};
    const double cells_per_metre = longest_axis(local_ray.d);
    const Segment inside = clip_to_box(local_ray, segment, m_march.kernel.grids[place.grid].bounds);
    if (!inside.empty()) zones.push_back({inside, cells_per_metre});
    if (in_haze.empty() || !place.curvature) return;
    for (const Illumination& sun : m_march.suns()) {
      const Segment shadow = shadow_of_box(ray, in_haze, sun.wi, place.box);
      if (!shadow.empty()) zones.push_back({shadow, cells_per_metre});
    }
  };
  if (has_hazes()) {
    for (const Place& place : m_places) add(place);
  } else {
    for_places_on(ray, add);
  }
}

size_t EnclosedWorld::memory_bytes() const {
  size_t sum = 0;
  for (const auto& [bricks, curvature] : m_curvatures) sum += curvature.grid->memory_bytes();
  return sum;
}

}  // namespace pileus
