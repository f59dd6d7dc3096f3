#pragma once

#include <span>

#include "lib/core/registry.h"
#include "lib/math/vec.h"
#include "lib/scene/light.h"

namespace pileus {

/// A point of a surface that is looked at.
struct SurfacePoint {
  Vec3d p;                 ///< world space [m]
  Vec3d n;                 ///< unit normal on the viewer's side
  double footprint = 0.0;  ///< width of the pixel's cone at p, across the ray [m]; 0: unknown
};

/// What a solid surface does with light.
struct SurfaceShader : Plugin {
  static constexpr const char* kKind = "surface";

  /// Radiance leaving a point towards wo [W/(m2 sr)]. Each light's irradiance already carries the
  /// transmittance of what lies between.
  virtual Rgb shade(const SurfacePoint& point, const Vec3d& wo,
                    std::span<const Illumination> lights) const = 0;
};

}  // namespace pileus
