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
#include "lib/core/param_table.h"
#include "lib/scene/point_source.h"

namespace pileus {
namespace {

struct PointLight final : PointSource {
  void describe(ParamTable& params) override {
    params.vector("position", position, "m", "of the light");
    params.rgb("intensity", intensity, "W/sr", "radiant intensity").at_least(0);
    params.number("radius", radius, "m", "distance below which the irradiance stays the same").at_least(1e-6);
  }
};

}  // namespace

PILEUS_PLUGIN(Light, point, PointLight, "shines from one point into all directions")

}  // namespace pileus
