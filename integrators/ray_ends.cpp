#include "integrators/ray_ends.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/math/offset_point.h"
#include "lib/scene/texture.h"
#include "lib/texture/texture_filter.h"

namespace pileus {
namespace {

double largest(const Rgb& rgb) {
  return std::max({rgb.x, rgb.y, rgb.z});
}

/// What rays that are not followed count less than, as a share of the tolerance; and where that is 0.
constexpr double kLeastShare = 0.02, kLeastWeight = 1e-7;

/// A bound that is proven knows of no rays that count too little.
double least_weight(const EffectPlan& plan, const Accuracy& accuracy) {
  if (plan.aovs.count("error_bound") > 0) return std::numeric_limits<double>::min();
  return std::max(kLeastShare * accuracy.tolerance * accuracy.coarseness, kLeastWeight);
}

/// Absorption behind a surface that a ray passes.
Rgb absorption_behind(const WorldHit& hit, const Rgb& before) {
  const Rgb own = hit.shape->shader->absorption_inside();
  if (!hit.is_inside) return before + own;
  const Rgb after = before - own;
  return {std::max(after.x, 0.0), std::max(after.y, 0.0), std::max(after.z, 0.0)};
}

/// Absorption on the way to a hit: a camera may stand inside the solid.
Rgb absorption_before(const WorldHit& hit, const RayPath& path) {
  return path.bounces == 0 && hit.is_inside ? hit.shape->shader->absorption_inside() : path.absorption;
}

}  // namespace

RayEnds::RayEnds(const World& world, const EffectPlan& plan, const Accuracy& accuracy)
    : m_world(world),
      m_plan(plan),
      m_cone(middle_pixel_cone(world, accuracy.picture)),
      m_least_weight(least_weight(plan, accuracy)),
      m_most_bounces(accuracy.most_bounces) {}

Rgb RayEnds::background(const Vec3d& d) const {
  Rgb sum = m_world.background->radiance(d);
  if (m_plan.sun_disc) {
    for (const auto& light : m_world.lights) sum += light->disc_radiance(d);
  }
  return sum;
}

std::optional<RayResult> RayEnds::uniform_background() const {
  const std::optional<Rgb> radiance = m_world.background->uniform();
  if (!radiance || m_plan.sun_disc) return std::nullopt;
  RayResult seen;
  seen.radiance = *radiance;
  seen.error = 0.0;
  return seen;
}

SurfacePoint RayEnds::surface_point(const Ray& ray, const WorldHit& hit, const RayPath& path,
                                    TraceCounters& counters) const {
  ++counters.surface_hits;
  SurfacePoint point{offset_point(ray.at(hit.t), hit.n, hit.error), hit.n, m_cone.width(path.length + hit.t),
                     hit.is_inside};
  if (m_plan.sky_light && hit.shape->shader->wants_sky()) {
    ++counters.sky_light_samples;
    point.sky = m_world.background->irradiance(hit.n);
  }
  if (m_plan.textures && hit.shape->shader->has_texture()) add_textures(ray, hit, point, counters);
  return point;
}

void RayEnds::add_textures(const Ray& ray, const WorldHit& hit, SurfacePoint& point,
                           TraceCounters& counters) const {
  const SurfaceShader& shader = *hit.shape->shader;
  const SurfaceArea area = seen_area(hit.n, -ray.d, point.footprint);
  const TexturedPoint here{ray.at(hit.t), hit.n, area.a, area.b};
  if (shader.texture) {
    ++counters.texture_lookups;
    const TextureValue value = shader.texture->at(here);
    point.color = value.color;
    point.opacity = value.opacity;
  }
  if (shader.opacity_texture) {
    ++counters.texture_lookups;
    point.opacity *= shader.opacity_texture->at(here).opacity;
  }
}

void RayEnds::light_points(std::span<const Ray> rays, std::span<const std::optional<WorldHit>> hits,
                           LitPoints& lit, TraceCounters& counters) const {
  lit.points.resize(rays.size());
  lit.light_counts.assign(rays.size(), 0);
  lit.most_lights = m_world.lights.size();
  lit.lights.resize(rays.size() * lit.most_lights);
  for (size_t i = 0; i < rays.size(); ++i) {
    if (hits[i]) lit.points[i] = surface_point(rays[i], *hits[i], {}, counters);
  }
  std::vector<Ray> shadows;
  std::vector<Segment> segments;
  std::vector<RaySight> sights;
  std::vector<Illumination*> asked;
  std::vector<char> occluded;
  for (const auto& light : m_world.lights) {
    shadows.clear(), segments.clear(), sights.clear(), asked.clear();
    for (size_t i = 0; i < rays.size(); ++i) {
      if (!hits[i]) continue;
      const SurfacePoint& point = lit.points[i];
      const Illumination here = light->at(point.p);
      if (dot(point.n, here.wi) <= 0.0) continue;  // from behind: nothing of it shows
      Illumination& place = lit.lights[i * lit.most_lights + lit.light_counts[i]++];
      place = here;
      asked.push_back(&place);
      shadows.push_back({point.p, here.wi});
      segments.push_back({0.0, here.distance});
      sights.push_back({0.0, point.footprint, 0.0});
    }
    if (!m_plan.surface_shadows || shadows.empty()) continue;
    counters.surface_shadow_rays += shadows.size();
    occluded.resize(shadows.size());
    find_occluded(m_world, shadows, segments, sights, occluded);
    for (size_t n = 0; n < asked.size(); ++n) {
      if (occluded[n]) asked[n]->irradiance = Rgb(0.0);
      if (m_plan.holes && !occluded[n])
        asked[n]->irradiance *=
            light_through_holes(m_world, shadows[n], segments[n], sights[n], counters.texture_lookups);
    }
  }
}

/// What solids let through of the light between the ray's origin and its end.
Rgb RayEnds::leg_transmittance(const WorldHit& hit, const RayPath& path) const {
  const Rgb tau = hit.t * absorption_before(hit, path);
  return {std::exp(-tau.x), std::exp(-tau.y), std::exp(-tau.z)};
}

std::vector<SecondaryRay> RayEnds::secondary_rays(const Ray& ray, const WorldHit& hit,
                                                  const SurfacePoint& point, const RayPath& path,
                                                  const Rgb& leg, double passed,
                                                  TraceCounters& counters) const {
  std::vector<SecondaryRay> rays;
  if (path.bounces >= m_most_bounces) return rays;
  std::vector<ScatteredRay> scattered;
  if (point.opacity > 0.0) hit.shape->shader->append_scattered(point, -ray.d, scattered);
  for (ScatteredRay& next : scattered) next.weight *= point.opacity;
  const size_t straight_on = scattered.size();
  if (point.opacity < 1.0) scattered.push_back({ray.d, Rgb(1.0 - point.opacity), true});
  for (size_t i = 0; i < scattered.size(); ++i) {
    const ScatteredRay& next = scattered[i];
    const Rgb weight = leg * next.weight;
    RayPath on{path.weight * passed * largest(weight), path.bounces + 1, path.length + hit.t,
               absorption_before(hit, path)};
    if (!(on.weight >= m_least_weight)) continue;
    if (next.passes) on.absorption = absorption_behind(hit, on.absorption);
    const Vec3d origin = next.passes ? offset_point(ray.at(hit.t), -hit.n, hit.error) : point.p;
    rays.push_back({{origin, next.d}, on, weight});
    ++(i == straight_on ? counters.passed_rays
       : next.passes    ? counters.refracted_rays
                        : counters.reflected_rays);
  }
  return rays;
}

}  // namespace pileus
