#pragma once

#include <string>
#include <vector>

#include "lib/cloud/picture_map.h"
#include "lib/math/vec.h"

namespace pileus {

class ParamTable;

/// The noise that carves a cloud: an octave sum in a space that is stretched, drifts and evolves.
struct CloudNoiseRecipe {
  std::string type = "billow";
  int octaves = 6;
  double frequency = 0.0;  ///< of the first octave [1/m]; 0: as `cells` says
  double cells = 2.2;      ///< of the first octave over the height of the free form
  double lacunarity = 2.0;
  double gain = 0.5;
  int seed = 0;
  Vec3d stretch{1.0, 1.0, 1.0};  ///< how much longer than their nominal size features are along x, y and z
  Vec3d offset{0.0, 0.0, 0.0};   ///< the pattern is moved by this [m]
  double evolution = 0.0;        ///< flow in place [turns of the first octave], as in FbmParams
  double warp = 0.0;             ///< [cells of the first octave]: how far noise displaces the pattern

  void describe(ParamTable& params);
};

/// What a procedural cloud is made of, apart from the free form that holds it. The defaults give a cumulus.
/// The mathematics is at ProceduralCloud (lib/cloud/procedural_cloud.h).
struct CloudRecipe {
  CloudRecipe();

  std::string preset = "cumulus";
  CloudNoiseRecipe noise;
  double erosion = 0.9;
  CloudNoiseRecipe detail;
  double detail_erosion = 0.0;
  std::vector<Vec2d> height_profile{{0.32, 0.0}, {0.43, 1.0}, {1.0, 0.7}};
  std::vector<Vec2d> width_profile{{0.0, 1.0}};
  std::vector<Vec2d> density_profile{{0.0, 1.0}};
  Vec3d shear{0.0, 0.0, 0.0};  ///< [m] across
  double edge = 0.7;
  double threshold = 0.1;
  double sharpness = 8.0;
  std::string falloff = "linear";
  PictureMapRecipe coverage_map, texture;

  /// The defaults are those of `preset`: all members take them.
  void describe(ParamTable& params);

  /// Appends a sentence for everything wrong that no single parameter's range can tell.
  void check(std::vector<std::string>& problems) const;
};

}  // namespace pileus
