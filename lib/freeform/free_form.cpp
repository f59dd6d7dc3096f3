#include "lib/freeform/free_form.h"

#include <cmath>

#include "lib/core/param_table.h"

namespace pileus {

void FreeForm::describe(ParamTable& params) {
  const auto describe_ellipsoid = [this](ParamTable& ellipsoid_params) {
    ellipsoid_params.vector("center", base.center, "m", "centre in world space");
    ellipsoid_params.vector("radii", base.size, "m", "half axes along x, y and z").above(0);
  };
  const auto describe_base = [describe_ellipsoid](ParamTable& base_params) {
    base_params.group("ellipsoid", describe_ellipsoid, "an ellipsoid along the axes");
  };
  params.group("base", describe_base, "the solid before any perturbation");
}

double FreeForm::value(const Vec3d& p_world) const {
  return base.value(p_world);
}

Vec3d FreeForm::gradient(const Vec3d& p_world) const {
  return base.gradient(p_world);
}

double FreeForm::upper_bound(const Box3d& box_world) const {
  // Local coordinates of a box near the solid are of size 1, and so are the terms: some 20 roundings.
  const double bound = base.upper_bound(box_world);
  return bound + 1e-14 * (1.0 + std::fabs(bound));
}

Box3d FreeForm::bounds() const {
  return {base.center - base.size, base.center + base.size};
}

}  // namespace pileus
