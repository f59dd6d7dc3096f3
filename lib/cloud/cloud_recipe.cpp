#include "lib/cloud/cloud_recipe.h"

#include <cmath>

#include <fmt/format.h>

#include "lib/core/param_table.h"

namespace pileus {

void CloudRecipe::describe(ParamTable& params) {
  const auto describe_noise = [this](ParamTable& p) {
    p.integer("octaves", noise.octaves, "sizes of billows, each finer than the one before")
        .at_least(1)
        .at_most(16);
    p.number("frequency", noise.frequency, "1/m",
             "of the coarsest billows; 0: fitted to the free form's height")
        .at_least(0);
    p.number("lacunarity", noise.lacunarity, "", "frequency of an octave over that of the one before")
        .at_least(1)
        .at_most(8);
    p.number("gain", noise.gain, "", "amplitude of an octave over that of the one before")
        .above(0)
        .at_most(1);
    p.integer("seed", noise.seed, "another number, another cloud").at_least(0);
  };
  params.group("noise", describe_noise, "the billows");
  params.points("height_profile", height_profile, "",
                "fullness (0 to 1) by relative height in the free form (0 bottom, 1 top), linear in between");
  params.number("edge", edge, "", "how far the fall-off reaches in: 0 only the surface, 1 up to the centre")
      .above(0)
      .at_most(1);
  params.number("erosion", erosion, "", "how deep the noise carves; 0 leaves the smooth free form")
      .at_least(0)
      .at_most(4);
  params.number("threshold", threshold, "", "what is thinner than this is clear air").at_least(0).below(1);
  params.number("sharpness", sharpness, "", "steepness of the edges; the density saturates at 1")
      .at_least(1)
      .at_most(100);
}

void CloudRecipe::check(std::vector<std::string>& problems) const {
  const auto is_share = [](double x) { return 0.0 <= x && x <= 1.0; };  // false for NaN
  if (height_profile.empty()) {
    problems.push_back("height_profile is empty; expected at least one [relative height, fullness]");
  }
  for (size_t i = 0; i < height_profile.size(); ++i) {
    const Vec2d& point = height_profile[i];
    if (!is_share(point.x) || !is_share(point.y)) {
      problems.push_back(fmt::format("height_profile point {} is [{}, {}]; expected both from 0 to 1", i + 1,
                                     point.x, point.y));
    }
    if (i > 0 && !(height_profile[i - 1].x < point.x)) {
      problems.push_back(
          fmt::format("height_profile has the height {} after {}; expected heights that increase", point.x,
                      height_profile[i - 1].x));
    }
  }
}

}  // namespace pileus
