/// Isotropic phase function: light scatters equally into all directions, p = 1 / (4 pi).
///
///   phase = { type = "isotropic" }
#include <numbers>

#include "lib/core/param_table.h"
#include "lib/scene/phase_function.h"

namespace pileus {
namespace {

struct Isotropic final : PhaseFunction {
  void describe(ParamTable&) override {}
  double p(const Vec3d&, const Vec3d&) const override { return 0.25 * std::numbers::inv_pi; }
  bool is_isotropic() const override { return true; }
};

}  // namespace

PILEUS_PLUGIN(PhaseFunction, isotropic, Isotropic, "scatters equally into all directions")

}  // namespace pileus
