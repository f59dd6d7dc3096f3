#include "integrators/lighting.h"

namespace pileus {

void TraceCounters::add_to(Counters& counters) const {
  counters["density_samples"] += camera.density_samples;
  counters["leaps"] += camera.leaps + shadow.leaps;
  counters["shadow_samples"] += shadow.density_samples;
  counters["source_samples"] += source_samples;
  counters["surface_hits"] += surface_hits;
  counters["surface_shadow_rays"] += surface_shadow_rays;
  counters["media_shadow_rays"] += media_shadow_rays;
}

}  // namespace pileus
