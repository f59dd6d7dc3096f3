/// Two Henyey-Greenstein lobes: a forward one and a backward one, as clouds show them (the bright rim towards
/// the sun, and the glory away from it).
///
///   p = w HG(g_forward) + (1 - w) HG(g_backward)
///
///   g_forward    asymmetry of the first lobe    [1]   -1 < g < 1, default 0.8
///   g_backward   asymmetry of the second lobe   [1]   -1 < g < 1, default -0.3
///   weight       w, share of the first lobe     [1]   0 <= w <= 1, default 0.8
///
///   phase = { type = "two_lobe", g_forward = 0.85, g_backward = -0.2, weight = 0.9 }
///
/// The mean cosine is w g_forward + (1 - w) g_backward. ref: henyey1941; METHODS 3.3
#include "lib/core/param_table.h"
#include "lib/math/henyey_greenstein.h"
#include "lib/math/lerp.h"
#include "lib/scene/phase_function.h"
#include "shaders_cpu/phase/scattering_cosine.h"

namespace pileus {
namespace {

struct TwoLobe final : PhaseFunction {
  double m_g_forward = 0.8;
  double m_g_backward = -0.3;
  double m_weight = 0.8;

  void describe(ParamTable& params) override {
    params.number("g_forward", m_g_forward, "", "asymmetry of the first lobe").above(-1).below(1);
    params.number("g_backward", m_g_backward, "", "asymmetry of the second lobe").above(-1).below(1);
    params.number("weight", m_weight, "", "share of the first lobe").at_least(0).at_most(1);
  }
  double p(const Vec3d& wo, const Vec3d& wi) const override {
    const double minus = one_minus_cos(wo, wi);
    const double plus = one_plus_cos(wo, wi);
    return lerp(henyey_greenstein(m_g_backward, minus, plus), henyey_greenstein(m_g_forward, minus, plus),
                m_weight);
  }
};

}  // namespace

PILEUS_PLUGIN(PhaseFunction, two_lobe, TwoLobe, "a forward and a backward lobe (two Henyey-Greenstein)")

}  // namespace pileus
