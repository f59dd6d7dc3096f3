#include "bench/micro/fixtures.h"

#include <algorithm>
#include <map>

#include "lib/freeform/free_form.h"
#include "lib/freeform/shapes.h"
#include "vdb_io/openvdb/build_cloud.h"
#include "vdb_io/openvdb/grid_to_field.h"
#include "vdb_io/openvdb/openvdb_library.h"

namespace pileus::bench {

const ProceduralCloud& cumulus() {
  static const ProceduralCloud cloud = [] {
    CloudRecipe recipe;
    recipe.noise.seed = 5;
    recipe.noise.frequency = 0.8;
    return ProceduralCloud(recipe, FreeForm{ellipsoid(Vec3d(0.0), Vec3d(1.0, 1.4, 1.0))});
  }();
  return cloud;
}

double cumulus_voxel_size(int voxels) {
  constexpr double kFilled =
      0.47;  // share of the free form's longest axis that noise and height profile leave
  const Vec3d size = cumulus().bounds().size();
  return kFilled * std::max({size.x, size.y, size.z}) / voxels;
}

std::shared_ptr<const DensityField> cumulus_field(int voxels) {
  static std::map<int, std::shared_ptr<const DensityField>> built;
  std::shared_ptr<const DensityField>& field = built[voxels];
  if (!field) {
    initialize_openvdb();
    CloudGridOptions options;
    options.voxel_size = cumulus_voxel_size(voxels);
    field = field_from_grid(build_cloud(cumulus(), options), Affine());
  }
  return field;
}

std::vector<Ray> camera_rays(const Box3d& box, int pixels) {
  const double reach = length(box.size());
  const Vec3d eye = box.center() + Vec3d(0.1, 0.2, 1.5) * reach;
  const Vec3d forward = normalize(box.center() - eye);
  const Vec3d right = normalize(cross(forward, Vec3d(0.0, 1.0, 0.0)));
  const Vec3d up = cross(right, forward);
  std::vector<Ray> rays;
  constexpr int kTile = 16;
  for (int i = 0; i < pixels * pixels; ++i) {
    {
      const int tile = i / (kTile * kTile), inner = i % (kTile * kTile), tiles = pixels / kTile;
      const int x = tile % tiles * kTile + inner % kTile, y = tile / tiles * kTile + inner / kTile;
      const double u = 0.35 * (2.0 * (x + 0.5) / pixels - 1.0), v = 0.35 * (1.0 - 2.0 * (y + 0.5) / pixels);
      rays.push_back({eye, normalize(forward + u * right + v * up)});
    }
  }
  return rays;
}

}  // namespace pileus::bench
