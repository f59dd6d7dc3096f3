#include "lib/cloud/cloud_presets.h"

#include <algorithm>

#include "lib/core/error.h"
#include "lib/freeform/join.h"
#include "lib/freeform/shapes.h"
#include "lib/math/affine.h"

namespace pileus {

namespace {

/// A heap with a flat base, bulging tops and sharp edges: what a recipe is anyway.
CloudRecipe cumulus() {
  return {};
}

/// A sheet without features but for soft waves in it.
CloudRecipe stratus() {
  CloudRecipe recipe;
  recipe.noise.type = "fbm";
  recipe.noise.stretch = {3, 1, 3};
  recipe.noise.gain = 0.5;
  recipe.erosion = 0.7;
  recipe.height_profile = {{0.1, 0}, {0.3, 1}, {0.7, 1}, {0.95, 0}};
  recipe.edge = 0.3;
  recipe.threshold = 0.15;
  recipe.sharpness = 1.5;
  recipe.falloff = "smooth";
  return recipe;
}

/// A tower that bulges, spreads into an anvil under the tropopause, and is fibrous up there.
CloudRecipe cumulonimbus() {
  CloudRecipe recipe;
  recipe.noise.cells = 3.2;
  recipe.noise.gain = 0.5;
  recipe.noise.octaves = 7;
  recipe.height_profile = {{0.06, 0}, {0.1, 1}, {0.8, 1}, {1, 0.8}};
  recipe.width_profile = {{0, 0.5},     {0.2, 0.6},   {0.5, 0.5}, {0.66, 0.45},
                          {0.77, 0.62}, {0.85, 0.95}, {0.92, 1},  {1, 0.95}};
  recipe.detail_erosion = 0.3;
  recipe.edge = 0.4;
  recipe.erosion = 1.0;
  return recipe;
}

/// Strands of ice that the wind draws out and bends.
CloudRecipe cirrus() {
  CloudRecipe recipe;
  recipe.noise.type = "ridged";
  recipe.noise.cells = 0.6;
  recipe.noise.stretch = {5, 1, 1.2};
  recipe.noise.warp = 1.2;
  recipe.noise.octaves = 7;
  recipe.noise.gain = 0.68;
  recipe.erosion = 3.8;
  recipe.height_profile = {{0, 0}, {0.5, 1}, {1, 0}};
  recipe.edge = 1;
  recipe.threshold = 0.05;
  recipe.sharpness = 2.5;
  recipe.falloff = "smooth";
  return recipe;
}

/// Mist that lies on the ground and thins out upwards.
CloudRecipe ground_fog() {
  CloudRecipe recipe;
  recipe.noise.type = "fbm";
  recipe.noise.stretch = {2.5, 1, 2.5};
  recipe.erosion = 1.2;
  recipe.height_profile = {{0, 1}, {0.5, 1}, {0.65, 0.7}, {0.8, 0.35}, {1, 0}};
  recipe.edge = 0.5;
  recipe.threshold = 0.05;
  recipe.sharpness = 1.2;
  recipe.falloff = "smooth";
  return recipe;
}

/// The trail behind an aircraft, drawn out and beaded.
CloudRecipe contrail() {
  CloudRecipe recipe;
  recipe.noise.stretch = {1.6, 1, 1};
  recipe.noise.octaves = 6;
  recipe.noise.gain = 0.6;
  recipe.height_profile = {{0, 1}};
  recipe.edge = 0.9;
  recipe.erosion = 0.8;
  recipe.threshold = 0.08;
  recipe.sharpness = 2.5;
  recipe.falloff = "smooth";
  return recipe;
}

/// The smoke of an explosion: cauliflower all around, dense to the rim.
CloudRecipe explosion() {
  CloudRecipe recipe;
  recipe.noise.cells = 3;
  recipe.noise.octaves = 7;
  recipe.noise.gain = 0.62;
  recipe.height_profile = {{0, 1}};
  recipe.edge = 0.5;
  recipe.erosion = 1.0;
  recipe.sharpness = 10;
  return recipe;
}

// Forms in the box from -1 to 1.

FreeForm united(const std::vector<FreeForm>& forms, double smooth) {
  FreeForm sum = forms.front();
  for (size_t i = 1; i < forms.size(); ++i) sum = joined(Join::unite, sum, forms[i], {smooth, 1.0});
  return sum;
}

/// Three domes of different height on one level. The preset's height profile cuts them below it.
FreeForm heap() {
  return united(
      {ellipsoid({-0.08, -0.12, 0}, {0.72, 1.1, 0.8}), ellipsoid({0.5, -0.3, 0.22}, {0.5, 0.75, 0.6}),
       ellipsoid({-0.6, -0.32, -0.2}, {0.4, 0.7, 0.55})},
      0.1);
}

/// A round slab: upright walls, flat above and below.
FreeForm slab() {
  return joined(Join::intersect, cylinder({0, 0, 0}, {0, 1, 0}, 1), plane_pair({0, 0, 0}, {0, 1, 0}, 2));
}

FreeForm ball() {
  return ellipsoid({0, 0, 0}, {1, 1, 1});
}

/// A round slab that is fullest at the ground and ends there.
FreeForm blanket() {
  const FreeForm layer =
      joined(Join::intersect, cylinder({0, 0, 0}, {0, 1, 0}, 1), plane_pair({0, -1, 0}, {0, 1, 0}, 4));
  return joined(Join::intersect, layer, plane({0, -1, 0}, {0, -1, 0}, 0.02));
}

/// Two vortices side by side along x.
FreeForm twin_trail() {
  return united({ellipsoid({0, 0, -0.45}, {1, 0.9, 0.5}), ellipsoid({0, 0, 0.45}, {1, 0.9, 0.5})}, 0.05);
}

/// A stem, a cap on it and a skirt of dust.
FreeForm mushroom() {
  return united({ellipsoid({0, 0.5, 0}, {0.95, 0.48, 0.95}), ellipsoid({0, -0.25, 0}, {0.34, 0.8, 0.34}),
                 ellipsoid({0, -0.8, 0}, {0.72, 0.19, 0.72})},
                0.12);
}

struct Preset {
  const char* name;
  CloudRecipe (*recipe)();
  FreeForm (*form)();
};
const std::vector<Preset> kPresets{{"cumulus", cumulus, heap},           {"stratus", stratus, slab},
                                   {"cumulonimbus", cumulonimbus, slab}, {"cirrus", cirrus, ball},
                                   {"ground_fog", ground_fog, blanket},  {"contrail", contrail, twin_trail},
                                   {"explosion", explosion, mushroom}};

const Preset& find(const std::string& name) {
  const auto found = std::find_if(kPresets.begin(), kPresets.end(),
                                  [&](const Preset& preset) { return preset.name == name; });
  PILEUS_CHECK(found != kPresets.end());
  return *found;
}

}  // namespace

std::vector<std::string> cloud_preset_names() {
  std::vector<std::string> names;
  for (const Preset& preset : kPresets) names.emplace_back(preset.name);
  return names;
}

CloudRecipe cloud_preset(const std::string& name) {
  CloudRecipe recipe = find(name).recipe();
  recipe.preset = name;
  return recipe;
}

FreeForm cloud_preset_form(const std::string& name, const Vec3d& center, const Vec3d& size) {
  return placed(find(name).form(), Affine::translation(center) * Affine::scaling(size * 0.5));
}

}  // namespace pileus
