/// Gradient background: a plain sky over a plain ground.
///
///   L(d) = horizon + (zenith - horizon) * d.y^exponent        above the horizon (d.y >= 0; y is up)
///   L(d) = horizon + (ground - horizon) * (-d.y)^exponent     below it
///
///   zenith     straight up          [W/(m2 sr)]   >= 0, default [0.2, 0.4, 0.8]
///   horizon    at eye level         [W/(m2 sr)]   >= 0, default [0.8, 0.85, 0.9]
///   ground     straight down        [W/(m2 sr)]   >= 0, default [0.2, 0.2, 0.18]
///   exponent   how fast the colour leaves the horizon's: below 1 soon, above 1 late   [1]   > 0, default 1
///
///   [background]
///   type = "gradient"
///   zenith = [0.15, 0.35, 0.8]
///   exponent = 0.6
///
/// Continuous everywhere; without a visible edge at the horizon where the exponent is above 1.
#include <algorithm>
#include <cmath>

#include "lib/core/param_table.h"
#include "lib/scene/background.h"

namespace pileus {
namespace {

struct Gradient final : Background {
  Rgb m_zenith{0.2, 0.4, 0.8};
  Rgb m_horizon{0.8, 0.85, 0.9};
  Rgb m_ground{0.2, 0.2, 0.18};
  double m_exponent = 1.0;

  void describe(ParamTable& params) override {
    params.rgb("zenith", m_zenith, "W/(m2 sr)", "straight up").at_least(0);
    params.rgb("horizon", m_horizon, "W/(m2 sr)", "at eye level").at_least(0);
    params.rgb("ground", m_ground, "W/(m2 sr)", "straight down").at_least(0);
    params.number("exponent", m_exponent, "", "how fast the colour leaves the horizon's").above(0);
  }
  Rgb radiance(const Vec3d& d) const override {
    const Rgb& far_end = d.y < 0.0 ? m_ground : m_zenith;
    const double share = std::pow(std::min(std::abs(d.y), 1.0), m_exponent);
    return m_horizon * (1.0 - share) + far_end * share;
  }
};

}  // namespace

PILEUS_PLUGIN(Background, gradient, Gradient, "a plain sky over a plain ground")

}  // namespace pileus
