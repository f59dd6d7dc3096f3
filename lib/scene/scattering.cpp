#include "lib/scene/scattering.h"

#include <cmath>

#include "lib/core/error.h"
#include "lib/core/param_table.h"
#include "lib/volume/density_field.h"

namespace pileus {

void MultipleScattering::describe(ParamTable& params) {
  const auto share = [&](const char* name, double& target, const char* help) {
    params.number(name, target, "1", help).above(0).at_most(1);
  };
  params.integer("octaves", octaves, "number of octaves; 1: single scattering").at_least(1).at_most(16);
  share("extinction", extinction, "factor from octave to octave on the optical depth towards the light");
  share("contribution", contribution, "factor from octave to octave on the light");
  share("phase", phase, "factor from octave to octave on the anisotropy of the phase function");
}

void Powder::describe(ParamTable& params) {
  params.number("strength", strength, "1", "darkening where nothing lies towards the light; 0: off")
      .at_least(0)
      .at_most(1);
  params.number("extinction", extinction, "1", "how fast it fades with the optical depth").above(0);
}

void SkyAround::describe(ParamTable& params) {
  params.rgb("top", top, "W/(m2 sr)", "radiance arriving from all around at the top of the volume")
      .at_least(0);
  params.rgb("bottom", bottom, "W/(m2 sr)", "the same at the bottom; linear in height between").at_least(0);
}

std::vector<ScatterTerm> scatter_terms(const MultipleScattering& octaves, const Powder& powder) {
  std::vector<ScatterTerm> terms;
  for (int i = 0; i < octaves.octaves; ++i) {
    const ScatterTerm octave{std::pow(octaves.contribution, i), std::pow(octaves.extinction, i),
                             std::pow(octaves.phase, i)};
    terms.push_back(octave);
    if (powder.strength > 0.0) {
      terms.push_back(
          {-powder.strength * octave.scale, octave.extinction + powder.extinction, octave.anisotropy});
    }
  }
  return terms;
}

AmbientLight ambient_light(const SkyAround& sky, const DensityField& density, const std::string& volume) {
  AmbientLight light;
  light.bottom = sky.bottom;
  light.top = sky.top;
  if (light.top == light.bottom) return light;  // of any height, also infinite
  const Box3d bounds = density.bounds();
  if (bounds.isEmpty() || bounds.min.y == bounds.max.y) return light;  // nothing to light
  if (!std::isfinite(bounds.min.y) || !std::isfinite(bounds.max.y)) {
    throw Error(
        ErrorKind::scene, SourceLoc{},
        fmt::format("volume \"{}\": ambient top = [{}, {}, {}] differs from bottom = [{}, {}, {}], but "
                    "the volume reaches from y = {} to {} m; expected equal values, or a finite volume",
                    volume, sky.top.x, sky.top.y, sky.top.z, sky.bottom.x, sky.bottom.y, sky.bottom.z,
                    bounds.min.y, bounds.max.y));
  }
  light.y0 = bounds.min.y;
  light.y1 = bounds.max.y;
  return light;
}

}  // namespace pileus
