/// Homogeneous box: density 1 between two corners. Its optical depth is the chord, so it is also the slab
/// that tests compare with.
///
///   [volume.slab]
///   type = "box"
///   min = [-1, 0, -1]      # [m]
///   max = [1, 2, 1]        # [m]
///   extinction = 0.5
#include "lib/scene/medium.h"
#include "lib/volume/analytic_fields.h"

namespace pileus {
namespace {

struct Box final : Medium {
  Vec3d min{-1.0, -1.0, -1.0}, max{1.0, 1.0, 1.0};

  void describe_density(ParamTable& params) override {
    params.vector("min", min, "m", "lower corner");
    params.vector("max", max, "m", "upper corner");
  }
  void commit(std::vector<std::string>& problems) override {
    const bool has_volume = min.x < max.x && min.y < max.y && min.z < max.z;
    if (!has_volume) problems.emplace_back("min must lie below max on every axis");
  }
  std::shared_ptr<const DensityField> build(const FreeForms&) const override {
    return make_box_field({min, max});
  }
};

}  // namespace

PILEUS_PLUGIN(Medium, box, Box, "homogeneous box")

}  // namespace pileus
