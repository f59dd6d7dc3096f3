#pragma once

#include <algorithm>

#include "lib/math/unit_vector.h"
#include "lib/scene/light.h"

namespace pileus {

/// A light that shines from one point into all directions alike: what integrators may know in closed form.
///   E(p) = intensity / max(distance, radius)^2
struct PointSource : Light {
  Vec3d position{0.0, 10.0, 0.0};      ///< world [m]
  Rgb intensity{100.0, 100.0, 100.0};  ///< [W/sr]
  double radius = 0.01;                ///< below this distance the irradiance stays the same [m]

  Illumination at(const Vec3d& p_world) const final {
    const Vec3d to_light = position - p_world;
    const double distance = length(to_light);
    const double reach = std::max(distance, radius);
    // In the very centre every direction is as good.
    const Vec3d wi = unit_vector(to_light).value_or(Vec3d(0.0, 1.0, 0.0));
    return {wi, distance, intensity / (reach * reach)};
  }
};

}  // namespace pileus
