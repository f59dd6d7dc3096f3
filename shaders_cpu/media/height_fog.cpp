/// Fog whose density falls off exponentially with height: rho = exp(-(y - base) / scale_height) for y >=
/// base, within `extent` of the origin and `top` above the base. Flat: beyond some 50 km the curvature of the
/// earth would count.
///
///   [volume.haze]
///   type = "height_fog"
///   base = 0               # [m]
///   scale_height = 40      # [m]
///   extinction = 0.01      # at the base
#include "lib/scene/medium.h"
#include "lib/volume/analytic_fields.h"

namespace pileus {
namespace {

struct HeightFog final : Medium {
  double base = 0.0, scale_height = 100.0, top = 10.0, extent = 50000.0;

  void describe_density(ParamTable& params) override {
    params.number("base", base, "m", "height below which there is no fog, and where the density is 1");
    params.number("scale_height", scale_height, "m", "rise over which the density falls to 1/e").above(0);
    params.number("top", top, "scale heights", "thickness of the layer").above(0).at_most(700);
    params.number("extent", extent, "m", "reach of the layer along x and z, from the origin").above(0);
  }
  std::shared_ptr<const DensityField> build(const FreeForms&) const override {
    const Box3d layer({-extent, base, -extent}, {extent, base + top * scale_height, extent});
    return make_height_fog_field(layer, scale_height);
  }
};

}  // namespace

PILEUS_PLUGIN(Medium, height_fog, HeightFog, "fog that thins out exponentially with height")

}  // namespace pileus
