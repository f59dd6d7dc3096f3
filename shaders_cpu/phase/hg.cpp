/// Henyey-Greenstein phase function: one lobe, from back-scattering (g < 0) over isotropic (0) to the sharp
/// forward peak of cloud droplets (0.85) and haze.
///
///   p(theta) = 1 / (4 pi) * (1 - g^2) / (1 + g^2 - 2 g cos theta)^(3/2),  theta = 0 straight on
///
///   g   asymmetry, the mean cosine of the scattering angle   [1]   -1 < g < 1, default 0
///
///   phase = { type = "hg", g = 0.6 }
///
/// Evaluated in a form that holds for every |g| < 1: no clamp. ref: henyey1941; METHODS 3.2
#include "lib/core/param_table.h"
#include "lib/math/henyey_greenstein.h"
#include "lib/scene/phase_function.h"
#include "shaders_cpu/phase/scattering_cosine.h"

namespace pileus {
namespace {

struct HenyeyGreenstein final : PhaseFunction {
  double m_g = 0.0;

  void describe(ParamTable& params) override {
    params.number("g", m_g, "", "asymmetry: mean cosine of the scattering angle").above(-1).below(1);
  }
  double p(const Vec3d& wo, const Vec3d& wi) const override {
    return henyey_greenstein(m_g, one_minus_cos(wo, wi), one_plus_cos(wo, wi));
  }
  bool is_isotropic() const override { return m_g == 0.0; }
};

}  // namespace

PILEUS_PLUGIN(PhaseFunction, hg, HenyeyGreenstein, "one lobe, forward or backward (Henyey-Greenstein)")

}  // namespace pileus
