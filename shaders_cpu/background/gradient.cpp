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
/// Its irradiance comes from a table, to 2e-4 of it. Continuous everywhere; without a visible edge at the
/// horizon where the exponent is above 1.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "lib/core/param_table.h"
#include "lib/scene/background.h"

namespace pileus {
namespace {

struct Gradient final : Background {
  Rgb m_zenith{0.2, 0.4, 0.8};
  Rgb m_horizon{0.8, 0.85, 0.9};
  Rgb m_ground{0.2, 0.2, 0.18};
  double m_exponent = 1.0;

  static constexpr int kAngles = 128, kRings = 256;
  std::array<Rgb, kAngles + 1> m_irradiance;  ///< of normals from straight up to straight down

  void describe(ParamTable& params) override {
    params.rgb("zenith", m_zenith, "W/(m2 sr)", "straight up").at_least(0);
    params.rgb("horizon", m_horizon, "W/(m2 sr)", "at eye level").at_least(0);
    params.rgb("ground", m_ground, "W/(m2 sr)", "straight down").at_least(0);
    params.number("exponent", m_exponent, "", "how fast the colour leaves the horizon's").above(0);
  }
  void commit(std::vector<std::string>&) override {
    m_irradiance.fill(Rgb(0.0));
    const double width = std::numbers::pi / kRings;
    for (int ring = 0; ring < kRings; ++ring) {
      const double elevation = (ring + 0.5) * width - 0.5 * std::numbers::pi;
      const double y = std::sin(elevation), across = std::cos(elevation);
      const Rgb light = radiance({across, y, 0.0}) * (across * width);
      for (int i = 0; i <= kAngles; ++i) {
        const double angle = i * std::numbers::pi / kAngles;
        m_irradiance[size_t(i)] += light * around_ring(std::cos(angle) * y, std::sin(angle) * across);
      }
    }
  }
  Rgb irradiance(const Vec3d& n) const override {
    const double at = kAngles * std::numbers::inv_pi * std::atan2(std::hypot(n.x, n.z), n.y);
    const size_t i = std::min(size_t(at), size_t(kAngles - 1));
    const double share = at - double(i);
    return m_irradiance[i] * (1.0 - share) + m_irradiance[i + 1] * share;
  }
  Rgb radiance(const Vec3d& d) const override {
    const Rgb& far_end = d.y < 0.0 ? m_ground : m_zenith;
    const double share = std::pow(std::min(std::abs(d.y), 1.0), m_exponent);
    return m_horizon * (1.0 - share) + far_end * share;
  }

 private:
  /// The integral of max(0, a + b cos(phi)) over a ring of the sky; b >= 0.
  static double around_ring(double a, double b) {
    if (a >= b) return 2.0 * std::numbers::pi * a;
    if (a <= -b) return 0.0;
    const double end = std::acos(-a / b);
    return 2.0 * (a * end + b * std::sin(end));
  }
};

}  // namespace

PILEUS_PLUGIN(Background, gradient, Gradient, "a plain sky over a plain ground")

}  // namespace pileus
