/// Constant background: the same radiance from everywhere.
///
///   radiance   [W/(m2 sr)]   >= 0, default [0, 0, 0]
///
///   [background]
///   type = "constant"
///   radiance = [0.2, 0.3, 0.5]
#include <numbers>

#include "lib/core/param_table.h"
#include "lib/scene/background.h"

namespace pileus {
namespace {

struct Constant final : Background {
  Rgb m_radiance{0.0, 0.0, 0.0};

  void describe(ParamTable& params) override {
    params.rgb("radiance", m_radiance, "W/(m2 sr)", "from every direction").at_least(0);
  }
  Rgb radiance(const Vec3d&) const override { return m_radiance; }
  std::optional<Rgb> uniform() const override { return m_radiance; }
  Rgb irradiance(const Vec3d&) const override { return std::numbers::pi * m_radiance; }
};

}  // namespace

PILEUS_PLUGIN(Background, constant, Constant, "the same radiance from everywhere")

}  // namespace pileus
