#pragma once

#include <span>

#include "lib/core/registry.h"
#include "lib/math/vec.h"
#include "lib/scene/light.h"

namespace pileus {

/// What a solid surface does with light.
struct SurfaceShader : Plugin {
  static constexpr const char* kKind = "surface";

  /// Radiance leaving a point towards wo [W/(m2 sr)]. `n` is the unit normal on the viewer's side; each
  /// light's irradiance already carries the transmittance of what lies between.
  virtual Rgb shade(const Vec3d& n, const Vec3d& wo, std::span<const Illumination> lights) const = 0;
};

}  // namespace pileus
