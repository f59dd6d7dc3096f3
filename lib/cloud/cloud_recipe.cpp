#include "lib/cloud/cloud_recipe.h"

#include <cmath>

#include <fmt/format.h>

#include "lib/cloud/cloud_presets.h"
#include "lib/core/param_table.h"

namespace pileus {

namespace {

constexpr double kNarrowest = 0.01;  ///< of width_profile

/// A profile's heights rise from 0 to 1, its values stay within their range.
void check_profile(const std::vector<Vec2d>& points, const char* name, Vec2d range,
                   std::vector<std::string>& problems) {
  const auto is_in = [](double x, double lo, double hi) { return lo <= x && x <= hi; };  // false for NaN
  if (points.empty()) {
    problems.push_back(fmt::format("{} is empty; expected at least one [relative height, value]", name));
  }
  for (size_t i = 0; i < points.size(); ++i) {
    const Vec2d& point = points[i];
    if (!is_in(point.x, 0, 1) || !is_in(point.y, range.x, range.y)) {
      problems.push_back(
          fmt::format("{} point {} is [{}, {}]; expected a height from 0 to 1 and a value from {} to {}",
                      name, i + 1, point.x, point.y, range.x, range.y));
    }
    if (i > 0 && !(points[i - 1].x < point.x)) {
      problems.push_back(fmt::format("{} has the height {} after {}; expected heights that increase", name,
                                     point.x, points[i - 1].x));
    }
  }
}

}  // namespace

void CloudNoiseRecipe::describe(ParamTable& params) {
  params.text("type", type, "billow: round bulges; fbm: even mixture; ridged: strands")
      .one_of({"billow", "fbm", "ridged"});
  params.integer("octaves", octaves, "sizes of features, each finer than the one before")
      .at_least(1)
      .at_most(16);
  params.number("frequency", frequency, "1/m", "of the coarsest features; 0: as cells says")
      .at_least(0)
      .at_most(1e6);
  params.number("cells", cells, "", "coarsest features over the free form's height, where frequency is 0")
      .above(0)
      .at_most(1e4);
  params.number("lacunarity", lacunarity, "", "frequency of an octave over that of the one before")
      .at_least(1)
      .at_most(8);
  params.number("gain", gain, "", "amplitude of an octave over that of the one before").above(0).at_most(1);
  params.integer("seed", seed, "another number, another cloud").at_least(0);
  params.vector("stretch", stretch, "", "features are longer by this along x, y and z").above(0).at_most(1e3);
  params.vector("offset", offset, "m", "moves the pattern: what drift animates").at_least(-1e9).at_most(1e9);
  params
      .number("evolution", evolution, "turns",
              "the pattern flows in place and is the same again after a whole turn: what boiling animates")
      .at_least(-1e6)
      .at_most(1e6);
  params.number("warp", warp, "cells", "how far noise displaces the pattern").at_least(0).at_most(4);
}

CloudRecipe::CloudRecipe() {
  noise.gain = 0.55;
  detail.octaves = 3;
  detail.cells = 26;
}

void CloudRecipe::describe(ParamTable& params) {
  *this = cloud_preset(preset);
  params.text("preset", preset, "kind of cloud: it sets the defaults of what follows")
      .one_of(cloud_preset_names());
  params.group(
      "noise", [this](ParamTable& p) { noise.describe(p); }, "the noise that carves the free form");
  params.number("erosion", erosion, "", "how deep the noise carves; 0 leaves the smooth free form")
      .at_least(0)
      .at_most(4);
  params.group(
      "detail",
      [this](ParamTable& p) {
        detail.describe(p);
        p.number("erosion", detail_erosion, "", "how much the detail eats away from the thin parts")
            .at_least(0)
            .at_most(4);
      },
      "a finer noise that frays the edges");
  params.points("height_profile", height_profile, "",
                "fullness (0 to 1) by relative height in the free form (0 bottom, 1 top), linear in between");
  params.points("width_profile", width_profile, "",
                "width of the free form, times this, by relative height: anvils and narrow bases");
  params.points("density_profile", density_profile, "", "factor of the density (0 to 1) by relative height");
  params.vector("shear", shear, "m", "how far the top of the free form is blown aside; the bottom stays");
  params.number("edge", edge, "", "how far the fall-off reaches in: 0 only the surface, 1 up to the centre")
      .above(0)
      .at_most(1);
  params.number("threshold", threshold, "", "what is thinner than this is clear air").at_least(0).below(1);
  params.number("sharpness", sharpness, "", "steepness of the edges; the density saturates at 1")
      .at_least(1)
      .at_most(100);
  params.text("falloff", falloff, "from the threshold on the density rises in a line, an S, or at once")
      .one_of({"linear", "smooth", "hard"});
  params.group(
      "coverage_map", [this](ParamTable& p) { coverage_map.describe(p); },
      "a picture of where clouds are, seen from above: times the fullness");
  params.group(
      "texture", [this](ParamTable& p) { texture.describe(p); },
      "a picture that gives the density: times the cloud's own");
}

void CloudRecipe::check(std::vector<std::string>& problems) const {
  check_profile(height_profile, "height_profile", {0, 1}, problems);
  check_profile(width_profile, "width_profile", {kNarrowest, 10}, problems);
  check_profile(density_profile, "density_profile", {0, 1}, problems);
  if (shear.y != 0) {
    problems.push_back(fmt::format("shear is [{}, {}, {}]; expected 0 along y: clouds are blown aside",
                                   shear.x, shear.y, shear.z));
  }
  coverage_map.check(problems, "coverage_map");
  texture.check(problems, "texture");
}

}  // namespace pileus
