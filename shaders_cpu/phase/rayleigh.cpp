/// Rayleigh phase function: scattering by particles far smaller than the wavelength, such as air molecules.
///
///   p(theta) = 3 / (16 pi) * (1 + cos^2 theta)
///
///   phase = { type = "rayleigh" }
///
/// The spectral dependence (the blue of the sky) belongs to the medium's coefficients, not here.
#include <numbers>

#include "lib/core/param_table.h"
#include "lib/scene/phase_function.h"

namespace pileus {
namespace {

struct Rayleigh final : PhaseFunction {
  void describe(ParamTable&) override {}
  double p(const Vec3d& wo, const Vec3d& wi) const override {
    const double cosine = dot(wo, wi);
    return 3.0 / 16.0 * std::numbers::inv_pi * (1.0 + cosine * cosine);
  }
};

}  // namespace

PILEUS_PLUGIN(PhaseFunction, rayleigh, Rayleigh, "scattering by air molecules")

}  // namespace pileus
