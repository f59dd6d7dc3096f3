#include "integrators/lighting.h"

#include <algorithm>
#include <limits>

#include "lib/math/box.h"

namespace pileus {

void TraceCounters::add_to(Counters& counters) const {
  counters["density_samples"] += camera.density_samples;
  counters["leaps"] += camera.leaps + shadow.leaps;
  counters["shadow_samples"] += shadow.density_samples;
  counters["source_samples"] += source_samples;
  counters["ambient_samples"] += ambient_samples;
  counters["surface_hits"] += surface_hits;
  counters["surface_shadow_rays"] += surface_shadow_rays;
  counters["media_shadow_rays"] += media_shadow_rays;
  counters["reflected_rays"] += reflected_rays;
  counters["refracted_rays"] += refracted_rays;
  counters["passed_rays"] += passed_rays;
  counters["texture_lookups"] += texture_lookups;
  counters["sky_light_samples"] += sky_light_samples;
  counters["fog_veils"] += fog_veils;
}

Segment media_range(const World& world, const Ray& ray, Segment segment) {
  Segment range{std::numeric_limits<double>::infinity(), 0.0};
  for (const WorldMedium& medium : world.media) {
    const Segment part = clip_to_box(ray, segment, medium.density->bounds());
    if (part.empty()) continue;
    range.t0 = std::min(range.t0, part.t0);
    range.t1 = std::max(range.t1, part.t1);
  }
  return range;
}

std::vector<size_t> media_with_ambient(const World& world) {
  std::vector<size_t> found;
  for (size_t m = 0; m < world.media.size(); ++m) {
    const WorldMedium& medium = world.media[m];
    if (medium.ambient.is_on() && medium.extinction > 0.0 && medium.albedo != Rgb(0.0)) found.push_back(m);
  }
  return found;
}

double slowest_extinction(const World& world) {
  double slowest = 1.0;
  for (const WorldMedium& medium : world.media) {
    for (const ScatterTerm& term : medium.scattering) slowest = std::min(slowest, term.extinction);
  }
  return slowest;
}

}  // namespace pileus
