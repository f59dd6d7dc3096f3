#pragma once

#include <string>
#include <vector>

#include "lib/math/vec.h"
#include "lib/noise/fbm.h"

namespace pileus {

class ParamTable;

/// What a procedural cloud is made of, apart from the free form that holds it. The defaults give a cumulus.
/// The mathematics is at ProceduralCloud (lib/cloud/procedural_cloud.h).
struct CloudRecipe {
  FbmParams noise{.frequency = 0.0,
                  .gain = 0.55};  ///< frequency 0: kAutomaticCells cells over the free form's height
  std::vector<Vec2d> height_profile{{0.32, 0.0}, {0.43, 1.0}, {1.0, 0.7}};
  double edge = 0.7;
  double erosion = 0.9;
  double threshold = 0.1;
  double sharpness = 8.0;

  /// Noise cells over the free form's height where the recipe leaves the frequency open.
  static constexpr double kAutomaticCells = 2.2;

  void describe(ParamTable& params);

  /// Appends a sentence for everything wrong that no single parameter's range can tell.
  void check(std::vector<std::string>& problems) const;
};

}  // namespace pileus
