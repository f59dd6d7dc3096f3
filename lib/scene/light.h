#pragma once

#include "lib/core/registry.h"
#include "lib/math/vec.h"

namespace pileus {

/// Light arriving at a point, before anything has been in its way.
struct Illumination {
  Vec3d wi;         ///< unit vector towards the light
  double distance;  ///< to the light [m]; infinite for a sun
  Rgb irradiance;   ///< on a surface that faces the light [W/m2]
};

struct Light : Plugin {
  static constexpr const char* kKind = "light";

  virtual Illumination at(const Vec3d& p_world) const = 0;

  /// True where wi and irradiance are the same everywhere (a sun): phase functions are then evaluated once
  /// per ray.
  virtual bool is_directional() const { return false; }

  /// True where the light is seen itself, as a disc in the sky.
  virtual bool has_disc() const { return false; }

  /// Radiance of the disc in the unit direction d, which meets nothing [W/(m2 sr)].
  virtual Rgb disc_radiance(const Vec3d& d) const {
    (void)d;
    return Rgb(0.0);
  }
};

}  // namespace pileus
