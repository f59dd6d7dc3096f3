/// A point light: shines equally into all directions.
///
///   E(p) = intensity / max(distance, radius)^2
///
///   position    of the light                                        [m]      default [0, 10, 0]
///   intensity   radiant intensity                                   [W/sr]   >= 0, default 100 per channel
///   radius      distance below which the irradiance stays the same  [m]      >= 1e-6, default 0.01
///
///   [light.lamp]
///   type = "point"
///   position = [2, 3, 1]
///   intensity = [40, 36, 30]
///
/// The radius keeps the light finite everywhere, also in a medium that surrounds it.
#include <algorithm>

#include "lib/core/param_table.h"
#include "lib/math/unit_vector.h"
#include "lib/scene/light.h"

namespace pileus {
namespace {

struct PointLight final : Light {
  Vec3d m_position{0.0, 10.0, 0.0};
  Rgb m_intensity{100.0, 100.0, 100.0};
  double m_radius = 0.01;

  void describe(ParamTable& params) override {
    params.vector("position", m_position, "m", "of the light");
    params.rgb("intensity", m_intensity, "W/sr", "radiant intensity").at_least(0);
    params.number("radius", m_radius, "m", "distance below which the irradiance stays the same")
        .at_least(1e-6);
  }
  Illumination at(const Vec3d& p_world) const override {
    const Vec3d to_light = m_position - p_world;
    const double distance = length(to_light);
    const double reach = std::max(distance, m_radius);
    // In the very centre every direction is as good.
    const Vec3d wi = unit_vector(to_light).value_or(Vec3d(0.0, 1.0, 0.0));
    return {wi, distance, m_intensity / (reach * reach)};
  }
};

}  // namespace

PILEUS_PLUGIN(Light, point, PointLight, "shines from one point into all directions")

}  // namespace pileus
