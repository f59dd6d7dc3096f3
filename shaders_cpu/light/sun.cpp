/// A sun: parallel light from one direction, equally strong everywhere.
///
///   direction    towards the light, of any length but 0      [1]      default [0.3, 0.8, 0.5]
///   irradiance   E on a surface that faces the light         [W/m2]   >= 0, default [3, 3, 3]
///   disc_deg     angular diameter of the disc in the sky     [deg]    0 .. 90, default 0: none is seen
///
///   [light.sun]
///   type = "sun"
///   direction = [0.3, 0.8, 0.5]
///   irradiance = [3.0, 2.9, 2.7]
///
/// A white diffuse surface that faces it shows the radiance E / pi. The disc is seen by rays that meet
/// nothing, also in mirrors and through glass; it is as bright as gives the irradiance E: E / (pi sin^2
/// (disc_deg / 2)). Shadows stay those of a point. The sun of the Earth has 0.53 degrees.
#include <cmath>
#include <limits>
#include <numbers>

#include "lib/core/param_table.h"
#include "lib/math/unit_vector.h"
#include "lib/scene/light.h"

namespace pileus {
namespace {

struct Sun final : Light {
  Vec3d m_direction{0.3, 0.8, 0.5};
  Rgb m_irradiance{3.0, 3.0, 3.0};
  double m_disc_deg = 0.0;
  Vec3d m_wi;
  double m_half_chord2 = 0.0;  ///< |d - wi|^2 at the rim of the disc
  Rgb m_disc{0.0, 0.0, 0.0};   ///< radiance of the disc

  void describe(ParamTable& params) override {
    params.vector("direction", m_direction, "", "towards the light; any length but 0");
    params.rgb("irradiance", m_irradiance, "W/m2", "on a surface that faces the light").at_least(0);
    params.number("disc_deg", m_disc_deg, "deg", "diameter of the disc that is seen; 0: none")
        .at_least(0)
        .at_most(90);
  }
  void commit(std::vector<std::string>& problems) override {
    const double half_angle = m_disc_deg / 360.0 * std::numbers::pi, sine = std::sin(half_angle);
    m_half_chord2 = 4.0 * std::pow(std::sin(0.5 * half_angle), 2);
    if (has_disc()) m_disc = m_irradiance / (std::numbers::pi * sine * sine);
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
  bool has_disc() const override { return m_disc_deg > 0.0; }
  Rgb disc_radiance(const Vec3d& d) const override {
    return (d - m_wi).length2() < m_half_chord2 ? m_disc : Rgb(0.0);
  }
};

}  // namespace

PILEUS_PLUGIN(Light, sun, Sun, "parallel light from one direction")

}  // namespace pileus
