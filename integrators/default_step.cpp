#include "integrators/default_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/scene/world.h"

namespace pileus {

double default_step(const World& world) {
  double step = std::numeric_limits<double>::infinity();
  for (const WorldMedium& medium : world.media) {
    const double feature = medium.density->feature_size();
    const double extent = length(medium.density->bounds().size());
    step = std::min(step, std::isfinite(feature) ? 0.5 * feature : extent / 256.0);
  }
  return step;
}

}  // namespace pileus
