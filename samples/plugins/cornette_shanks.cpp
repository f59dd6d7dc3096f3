/// Cornette-Shanks phase function: Henyey-Greenstein made physical, so that g = 0 is Rayleigh's 1 + cos^2.
///
///   p = 3 / (8 pi) * (1 - g^2) / (2 + g^2) * (1 + cos^2) / (1 + g^2 - 2 g cos)^(3/2)
///
/// An example of a plugin that lives outside the program: build it with pileus_add_plugin_library(), then
///
///   PILEUS_PLUGIN_PATH=cornette_shanks.so pileus render scene.toml -o picture.png
///
/// lets a scene say `phase = { type = "cornette_shanks", g = 0.6 }`.
///
/// ref: cornette1992
#include <cmath>
#include <numbers>

#include "lib/core/param_table.h"
#include "lib/scene/phase_function.h"

namespace pileus {
namespace {

struct CornetteShanks final : PhaseFunction {
  double g = 0.0;

  void describe(ParamTable& params) override {
    params.number("g", g, "", "asymmetry: > 0 scatters forward, < 0 backward").above(-1).below(1);
  }

  double p(const Vec3d& wo, const Vec3d& wi) const override {
    // 1 - cos near the peak, from the difference of the directions of travel -wi and wo: never cancels.
    const Vec3d difference = g >= 0.0 ? wo + wi : wo - wi;
    const double from_peak = 0.5 * dot(difference, difference);
    const double e = 1.0 - std::abs(g);
    const double denominator = e * e + 2.0 * std::abs(g) * from_peak;
    const double cosine = dot(wo, wi);  // of either sign: only its square counts
    const double scale = 0.375 * std::numbers::inv_pi * e * (1.0 + std::abs(g)) / (2.0 + g * g);
    return scale * (1.0 + cosine * cosine) / (denominator * std::sqrt(denominator));
  }
};

}  // namespace

PILEUS_PLUGIN(PhaseFunction, cornette_shanks, CornetteShanks, "Rayleigh-like lobes with an asymmetry")

}  // namespace pileus
