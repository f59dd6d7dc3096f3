#include "integrators/sunlight.h"

#include <algorithm>
#include <limits>
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

/// What all lights make of a pilot's pixel.
double light_of(const MarchWorld& march, const PilotRay& pilot) {
  constexpr double kDark = std::numeric_limits<double>::infinity();
  double sum = 0.0;
  for (const PilotPoint& point : pilot.points) {
    for (size_t l = 0; l < march.suns().size(); ++l)
      sum += point.share * std::abs(change_of_light(march, point.weights, l, point.depths[l], kDark));
  }
  return sum;
}

/// What lamps light closely is far brighter than the rest: lattices that were fine enough for that would be
/// too fine. Few pilots may be bright; they are judged as if they were as bright as the brightest of the
/// others. Returns how bright that is.
double scale_bright_ones(const MarchWorld& march, Pilots& pilots) {
  constexpr double kFew = 0.02;
  std::vector<double> lights;
  for (const PilotRay& pilot : pilots) lights.push_back(light_of(march, pilot));
  if (lights.empty()) return 0.0;
  std::vector<double> sorted = lights;
  std::sort(sorted.begin(), sorted.end());
  const double bright = sorted[size_t((1.0 - kFew) * double(sorted.size() - 1))];
  for (size_t i = 0; i < pilots.size(); ++i)
    if (lights[i] > bright) pilots[i].scale = bright / lights[i];
  return bright;
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
    for (PilotRay& pilot : pilots) set_point_weights(march, pilot);
    if (march.has_lamps()) choice.bright = scale_bright_ones(march, pilots);
    return pilots;
  };
  if (most_bytes > 0.0 && find_lattices(trace, tolerance, most_bytes, march, choice)) return choice;
  clear_lattices(march);
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
