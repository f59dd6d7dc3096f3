/// A sun: parallel light from one direction, equally strong everywhere.
///
///   direction    towards the light, of any length but 0      [1]      default [0.3, 0.8, 0.5]
///   irradiance   E on a surface that faces the light         [W/m2]   >= 0, default [3, 3, 3]
///
///   [light.sun]
///   type = "sun"
///   direction = [0.3, 0.8, 0.5]
///   irradiance = [3.0, 2.9, 2.7]
///
/// A white diffuse surface that faces it shows the radiance E / pi.
#include <limits>

#include "lib/core/param_table.h"
#include "lib/math/unit_vector.h"
#include "lib/scene/light.h"

namespace pileus {
namespace {

struct Sun final : Light {
  Vec3d m_direction{0.3, 0.8, 0.5};
  Rgb m_irradiance{3.0, 3.0, 3.0};
  Vec3d m_wi;

  void describe(ParamTable& params) override {
    params.vector("direction", m_direction, "", "towards the light; any length but 0");
    params.rgb("irradiance", m_irradiance, "W/m2", "on a surface that faces the light").at_least(0);
  }
  void commit(std::vector<std::string>& problems) override {
    if (const auto wi = unit_vector(m_direction)) {
      m_wi = *wi;
    } else {
      problems.push_back("direction is zero or not finite; expected a vector towards the light");
    }
  }
  Illumination at(const Vec3d&) const override {
    return {m_wi, std::numeric_limits<double>::infinity(), m_irradiance};
  }
  bool is_directional() const override { return true; }
};

}  // namespace

PILEUS_PLUGIN(Light, sun, Sun, "parallel light from one direction")

}  // namespace pileus
