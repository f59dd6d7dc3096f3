#include "integrators/sunlight.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "integrators/lattice_search.h"
#include "integrators/sun_pilots.h"

namespace pileus {
namespace {

void take_shadow_rays(Pilots pilots, double tolerance, MarchWorld& march, SunlightChoice& choice) {
  take_exact_depths(march, pilots);
  constexpr double kLongest = 1.0, kShortest = 1.0 / 16.0;  // steps [cells]
  for (choice.step = kLongest;; choice.step *= 0.5) {
    choice.error = measured_error(
        pilots, march, [&](size_t l, const Vec3d& p) { return stepped_depth(march, l, p, choice.step); });
    if (choice.error <= tolerance || choice.step <= kShortest) break;
  }
  march.kernel.shadow_step = choice.step;
}

/// The most sunlight that any ray of the picture can get from an opaque medium. Phase functions may be
/// narrow: a raster as fine as theirs is looked at.
double brightest_sunlight(const World& world, const Vec2i& picture, const MarchWorld& march) {
  const Vec2i raster = march.is_isotropic() ? Vec2i(1, 1) : Vec2i(96, 54);
  double brightest = 0.0;
  std::vector<float> weights;
  for (int i = 0; i < raster.x * raster.y; ++i) {
    const Vec2d pixel((i % raster.x + 0.5) / raster.x * picture.x,
                      (i / raster.x + 0.5) / raster.y * picture.y);
    march.weights_for(world.camera->ray(pixel, picture).d, weights);
    brightest = std::max(brightest, march.sunlit(weights.data()));
  }
  return brightest;
}

/// Pilots are few: none may look where a narrow phase function scatters most, so all are judged as if they
/// did.
void judge_as_brightest(const MarchWorld& march, double brightest, PilotRay& pilot) {
  const double own = march.sunlit(pilot.weights.data());
  if (!(own > 0.0)) return;
  for (float& weight : pilot.weights) weight *= float(brightest / own);
}

}  // namespace

SunlightChoice choose_sunlight(const World& world, const Vec2i& picture, double tolerance, double most_bytes,
                               MarchWorld& march) {
  SunlightChoice choice;
  choice.brightest = brightest_sunlight(world, picture, march);
  if (march.kernel.grids.empty()) {
    choice.reason = "in closed form: no medium is a grid";
    return choice;
  }
  const auto trace = [&](int points) {
    Pilots pilots = trace_pilots(world, picture, march, points);
    for (PilotRay& pilot : pilots) judge_as_brightest(march, choice.brightest, pilot);
    return pilots;
  };
  if (most_bytes > 0.0 && find_lattices(trace, tolerance, most_bytes, march, choice)) return choice;
  march.kernel.lattices.clear();
  const std::string why =
      most_bytes > 0.0 ? fmt::format("a cache within {:.2g} would need more than the {:.0f} MB allowed",
                                     tolerance, 1e-6 * most_bytes)
                       : "no cache asked for";
  choice.spacing = 0.0;
  take_shadow_rays(trace(kFewPoints), tolerance, march, choice);
  choice.reason = fmt::format("shadow rays with steps of {:.2g} voxels ({}): estimated error {:.2g}",
                              choice.step, why, choice.error);
  return choice;
}

}  // namespace pileus
