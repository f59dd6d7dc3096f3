/// Homogeneous ellipsoid: density 1 inside, 0 outside.
///
///   [volume.ball]
///   type = "ellipsoid"
///   center = [0, 1, 0]     # [m]
///   radii = [1, 1, 1]      # [m]
///   extinction = 2
#include "lib/scene/medium.h"
#include "lib/volume/analytic_fields.h"

namespace pileus {
namespace {

struct Ellipsoid final : Medium {
  Vec3d center{0.0, 0.0, 0.0}, radii{1.0, 1.0, 1.0};

  void describe_density(ParamTable& params) override {
    params.vector("center", center, "m", "centre");
    params.vector("radii", radii, "m", "half axes along x, y and z").above(0);
  }
  std::shared_ptr<const DensityField> build(const FreeForms&) const override {
    return make_ellipsoid_field(center, radii);
  }
};

}  // namespace

PILEUS_PLUGIN(Medium, ellipsoid, Ellipsoid, "homogeneous ellipsoid")

}  // namespace pileus
