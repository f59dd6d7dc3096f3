#include "lib/scene/medium.h"

#include <cmath>
#include <numbers>

namespace pileus {

void Medium::describe(ParamTable& params) {
  describe_density(params);
  if (has_own_light()) describe_light(params);
  params.boolean("hidden", hidden, "not shown itself: only its instances are");
}

void MediumLight::describe_light(ParamTable& params) {
  params.number("extinction", extinction, "1/m", "extinction coefficient where the density is 1").at_least(0);
  params.rgb("albedo", albedo, "1", "share of the extinction that is scattering").at_least(0).at_most(1);
  params.rgb("emission", emission, "W/(m3 sr)", "radiance emitted per metre where the density is 1")
      .at_least(0);
  params.plugin<PhaseFunction>("phase", phase, "isotropic", "how scattered light is spread over directions");
  params.group(
      "multiple_scattering", [this](ParamTable& group) { multiple_scattering.describe(group); },
      "light scattered more than once, as octaves of single scattering");
  params.group(
      "powder", [this](ParamTable& group) { powder.describe(group); },
      "darkening where little of the medium lies towards the light");
  params.group(
      "ambient", [this](ParamTable& group) { ambient.describe(group); }, "light of the sky around");
}

void Placement::describe(ParamTable& params) {
  params.vector("scale", scale, "1", "size factors along the object's axes, applied first").above(0);
  params.vector("rotate_deg", rotate_deg, "deg", "rotation about the x, then the y, then the z axis");
  params.vector("translate", translate, "m", "offset, applied last");
}

Affine Placement::world_from_object() const {
  const Vec3d r = rotate_deg * (std::numbers::pi / 180.0);
  Imath::M44d about_x, about_y, about_z;
  about_x.setAxisAngle(Vec3d(1, 0, 0), r.x);
  about_y.setAxisAngle(Vec3d(0, 1, 0), r.y);
  about_z.setAxisAngle(Vec3d(0, 0, 1), r.z);
  Imath::M44d rotation = (Affine(about_z) * Affine(about_y) * Affine(about_x)).matrix();
  // A quarter turn leaves rounding where zeros belong; axes that stay along the axes keep bounds finite.
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      if (std::fabs(rotation[row][column]) < 1e-15) rotation[row][column] = 0.0;
    }
  }
  return Affine::translation(translate) * Affine(rotation) * Affine::scaling(scale);
}

}  // namespace pileus
