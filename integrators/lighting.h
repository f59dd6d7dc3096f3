#pragma once

#include <limits>
#include <vector>

#include "lib/math/ray.h"
#include "lib/math/transmittance.h"
#include "lib/scene/effect_plan.h"
#include "lib/scene/world.h"

namespace pileus {

/// How often things happened while a tile was traced.
struct TraceCounters {
  FieldCounters camera;          ///< density look-ups and leaps along camera rays
  FieldCounters shadow;          ///< the same along shadow rays
  uint64_t source_samples = 0;   ///< points at which the in-scattered light was evaluated
  uint64_t ambient_samples = 0;  ///< the same for the light of the sky, once per medium in it
  uint64_t surface_hits = 0;
  uint64_t surface_shadow_rays = 0;
  uint64_t media_shadow_rays = 0;
  uint64_t reflected_rays = 0;  ///< that go on from a surface on the side they came from
  uint64_t refracted_rays = 0;  ///< and those that pass through it
  uint64_t passed_rays = 0;     ///< and those that go straight on where a texture is not opaque
  uint64_t texture_lookups = 0;
  uint64_t sky_light_samples = 0;  ///< points whose light from the background was asked for
  uint64_t fog_veils = 0;          ///< places seen through fog, whose dimming and light were evaluated

  void add_to(Counters& counters) const;
  uint64_t samples() const { return camera.density_samples + shadow.density_samples; }
};

/// What light meets on its way to a point.
struct LightWay {
  double passed = 1.0;  ///< share that solids let through
  double depth = 0.0;   ///< optical depth of the media; not looked for behind solids
};

/// The way between p and a light.
/// `media_depth(ray, segment)` is how the integrator at hand measures it; `seen`: how fine shadows show.
template <class MediaDepth>
LightWay way_to_light(const World& world, const EffectPlan& plan, const Vec3d& p, const Illumination& light,
                      TraceCounters& counters, MediaDepth&& media_depth, const RaySight& seen = {}) {
  const Ray ray{p, light.wi};
  const Segment segment{0.0, light.distance};
  LightWay way;
  if (plan.surface_shadows) {
    ++counters.surface_shadow_rays;
    if (is_occluded(world, ray, segment, seen)) return {0.0};
    if (plan.holes) way.passed = light_through_holes(world, ray, segment, seen, counters.texture_lookups);
    if (!(way.passed > 0.0)) return way;
  }
  if (!plan.media_shadows) return way;
  ++counters.media_shadow_rays;
  way.depth = media_depth(ray, segment);
  return way;
}

/// The stretch of a ray in which media can be; empty where there is none.
Segment media_range(const World& world, const Ray& ray, Segment segment);

/// The media of a world that scatter light of a sky.
std::vector<size_t> media_with_ambient(const World& world);

/// The smallest factor on the optical depth towards a light by which some medium responds to it: shadow rays
/// go on until the light behind that is spent.
double slowest_extinction(const World& world);

}  // namespace pileus
