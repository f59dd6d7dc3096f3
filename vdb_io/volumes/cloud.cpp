/// A procedural cloud inside a free form, built into a sparse grid.
///
/// Billowed noise carves the free form: round bulges with creases between them, a flat base where the height
/// profile starts, edges that fade out before the free form's surface is reached. `bounds` and `voxel_size`
/// are enough for a cumulus.
///
///   [freeform.blob]
///   base = { ellipsoid = { center = [0, 1.6, 0], radii = [3, 1.6, 2.2] } }
///
///   [volume.cumulus]
///   type       = "cloud"
///   bounds     = "blob"
///   voxel_size = 0.03
///   noise      = { seed = 5 }
///   extinction = 18
#include "vdb_io/volumes/cloud.h"

#include <utility>

#include <fmt/format.h>

#include "lib/cloud/procedural_cloud.h"
#include "lib/core/error.h"
#include "lib/freeform/free_form.h"
#include "lib/math/affine.h"
#include "vdb_io/build_cloud.h"
#include "vdb_io/grid_to_field.h"

namespace pileus {

namespace {

const FreeForm& find_free_form(const FreeForms& freeforms, const std::string& name) {
  const auto found = freeforms.find(name);
  if (found != freeforms.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& entry : freeforms) names.push_back(entry.first);
  const std::string nearest = nearest_name(name, names);
  throw Error(ErrorKind::scene, SourceLoc{},
              fmt::format("no free form \"{}\"; expected {}{}", name,
                          names.empty() ? "a [freeform.NAME] section" : join_or(names),
                          nearest.empty() ? "" : "; nearest: " + nearest));
}

}  // namespace

void CloudVolume::describe_density(ParamTable& params) {
  params.reference("bounds", bounds, "freeform", "the free form that holds the cloud").required();
  params.number("voxel_size", voxel_size, "m", "edge of a voxel").above(0).required();
  params.integer("max_voxels", max_voxels, "allowed in the bounding box; 4 bytes each at worst").at_least(1);
  recipe.describe(params);
}

void CloudVolume::commit(std::vector<std::string>& problems) {
  recipe.check(problems);
}

std::shared_ptr<const DensityField> CloudVolume::build(const FreeForms& freeforms) const {
  return field_from_grid(*build_grid(freeforms, {}), Affine());
}

openvdb::FloatGrid::Ptr CloudVolume::build_grid(const FreeForms& freeforms,
                                                std::function<bool(double)> progress) const {
  const ProceduralCloud cloud(recipe, find_free_form(freeforms, bounds));
  return build_cloud(cloud, {voxel_size, max_voxels, std::move(progress)});
}

PILEUS_PLUGIN(Medium, cloud, CloudVolume, "procedural cloud that billows inside a free form")

}  // namespace pileus
