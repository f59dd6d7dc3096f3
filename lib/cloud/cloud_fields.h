#pragma once

#include "lib/cloud/cloud_shape.h"
#include "lib/cloud/picture_map.h"
#include "lib/math/vec.h"
#include "lib/noise/perlin.h"

namespace pileus {

class ParamTable;
class ProceduralCloud;

/// What simulators and renderers may want of a cloud besides its density.
struct CloudFieldsRecipe {
  double temperature = 288.15;  ///< at the bottom of the cloud [K]
  double lapse = 0.0065;        ///< [K/m]: it falls with height
  double excess = 0.0;          ///< where the density is 1 [K]
  Rgb color_bottom{1.0, 1.0, 1.0}, color_top{1.0, 1.0, 1.0};
  Vec3d wind{0.0, 0.0, 0.0};  ///< [m/s]
  double updraft = 0.0;       ///< where the density is 1 [m/s]
  double turbulence = 0.0;    ///< [m/s]

  void describe(ParamTable& params);
};

/// Temperature, colour and velocity of a cloud as functions of space:
///   temperature = temperature - lapse (y - bottom) + excess rho                    [K]
///   colour      = the texture's, or from color_bottom to color_top by height       linear RGB
///   velocity    = wind + updraft rho y + turbulence curl(noises), which diverges nowhere but for the updraft
///   [m/s]
/// threads: const, safe from many threads; the cloud must outlive it
class CloudFields {
 public:
  CloudFields(const CloudFieldsRecipe& recipe, const ProceduralCloud& cloud);

  double temperature(const Vec3d& p_world, double rho) const;
  Rgb color(const Vec3d& p_world) const;
  Vec3d velocity(const Vec3d& p_world, double rho) const;

 private:
  Vec3d curl(const Vec3d& p_world) const;

  CloudFieldsRecipe m_recipe;
  const CloudShape& m_shape;
  const PictureMap* m_texture;
  PerlinNoise m_noise;
  double m_frequency;  ///< of the largest eddies [1/m]
};

}  // namespace pileus
