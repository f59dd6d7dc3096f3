#pragma once

#include <optional>
#include <span>
#include <vector>

#include "integrators/lighting.h"
#include "integrators/pixel_cone.h"

namespace pileus {

/// How a ray came to be: from the camera, or by way of mirrors and glass.
struct RayPath {
  double weight = 1.0;            ///< strongest channel of what its radiance counts in the pixel
  int bounces = 0;                ///< surfaces on the way
  double length = 0.0;            ///< from the camera to its origin [m]
  Rgb absorption{0.0, 0.0, 0.0};  ///< of the solids that it starts in [1/m]
};

/// A ray that goes on from the end of another.
struct SecondaryRay {
  Ray ray;
  RayPath path;
  Rgb weight;  ///< of its radiance in that of the other
};

/// What rays see at their ends: lit surfaces, mirrors and glass, the background. One for all integrators.
class RayEnds {
 public:
  /// World and plan outlive it.
  RayEnds(const World& world, const EffectPlan& plan, const Accuracy& accuracy);

  /// The radiance that arrives from the end of a ray.
  ///   passed: share of it that shows
  ///   media_depth(ray, segment): optical depth, as the integrator at hand measures it
  ///   go_on(secondary ray): the radiance of that ray, not yet weighted; or zero, where it is added later. No
  ///     ray goes on that counts less in the pixel than a share of the tolerance, nor after
  ///     Accuracy::most_bounces surfaces
  template <class MediaDepth, class GoOn>
  Rgb radiance(const Ray& ray, const std::optional<WorldHit>& hit, const RayPath& path, double passed,
               TraceCounters& counters, MediaDepth&& media_depth, GoOn&& go_on) const {
    if (!hit) return after_endless_leg(background(ray.d), path);
    const SurfacePoint point = surface_point(ray, *hit, path, counters);
    const RaySight shadows{0.0, point.footprint, 0.0};
    std::vector<Illumination> lights;
    for (const auto& light : m_world.lights) {
      Illumination here = light->at(point.p);
      if (dot(point.n, here.wi) <= 0.0) continue;  // from behind: nothing of it shows
      const LightWay way = way_to_light(m_world, m_plan, point.p, here, counters, media_depth, shadows);
      here.irradiance *= way.passed * transmittance(way.depth);
      lights.push_back(here);
    }
    return radiance(ray, *hit, path, passed, point, lights, counters, go_on);
  }

  /// Where neighbouring rays from the camera end, and the lights there.
  struct LitPoints {
    std::vector<SurfacePoint> points;  ///< of each ray; unset where it meets nothing
    std::vector<size_t> light_counts;
    std::vector<Illumination> lights;  ///< [ray][light]: the first of each ray are told; black behind solids
    size_t most_lights = 0;

    std::span<const Illumination> lights_at(size_t ray) const {
      return std::span(lights).subspan(ray * most_lights, light_counts[ray]);
    }
  };

  /// Asks for the shadows of all ends together; for worlds without media.
  void light_points(std::span<const Ray> rays, std::span<const std::optional<WorldHit>> hits, LitPoints& lit,
                    TraceCounters& counters) const;

  /// The radiance from a point that is lit by these lights.
  template <class GoOn>
  Rgb radiance(const Ray& ray, const WorldHit& hit, const RayPath& path, double passed,
               const SurfacePoint& point, std::span<const Illumination> lights, TraceCounters& counters,
               GoOn&& go_on) const {
    const Rgb lit = point.opacity * hit.shape->shader->shade(point, -ray.d, lights);
    if (!m_plan.secondary_rays()) return lit;
    const Rgb leg = leg_transmittance(hit, path);
    Rgb sum = leg * lit;
    for (const SecondaryRay& next : secondary_rays(ray, hit, point, path, leg, passed, counters)) {
      sum += next.weight * go_on(next);
    }
    return sum;
  }

  /// How wide pixels are along a ray that comes by a path.
  RaySight sight(const RayPath& path) const { return {0.0, m_cone.width(path.length), m_cone.per_metre}; }

  /// What a ray of direction d sees that meets nothing.
  Rgb background(const Vec3d& d) const;

  /// What any ray from the camera sees that meets nothing; none where it depends on the ray.
  std::optional<RayResult> uniform_background() const;

 private:
  SurfacePoint surface_point(const Ray& ray, const WorldHit& hit, const RayPath& path,
                             TraceCounters& counters) const;
  /// Puts what the textures say into a point.
  void add_textures(const Ray& ray, const WorldHit& hit, SurfacePoint& point, TraceCounters& counters) const;
  Rgb leg_transmittance(const WorldHit& hit, const RayPath& path) const;
  std::vector<SecondaryRay> secondary_rays(const Ray& ray, const WorldHit& hit, const SurfacePoint& point,
                                           const RayPath& path, const Rgb& leg, double passed,
                                           TraceCounters& counters) const;

  /// Of a ray that starts in an absorbing solid and never leaves it, nothing comes back.
  static Rgb after_endless_leg(const Rgb& light, const RayPath& path) {
    const Rgb& a = path.absorption;
    return {a.x > 0.0 ? 0.0 : light.x, a.y > 0.0 ? 0.0 : light.y, a.z > 0.0 ? 0.0 : light.z};
  }

  const World& m_world;
  const EffectPlan& m_plan;
  PixelCone m_cone;
  double m_least_weight;  ///< in the pixel, below which no ray goes on
  int m_most_bounces;
};

}  // namespace pileus
