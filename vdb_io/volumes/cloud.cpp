/// A procedural cloud inside a free form, built into a sparse grid.
///
/// Billowed noise carves the free form: round bulges with creases between them, a flat base where the height
/// profile starts, edges that end before the free form's surface is reached. `size` and `voxel_size` are
/// enough for a cumulus. The formula stands in lib/cloud/cloud_formula.h, the rest of the parameters in
/// docs/clouds.md.
///
///   preset           cumulus, stratus, cumulonimbus, cirrus, ground_fog, contrail or explosion: sets the
///                    defaults of the rest; those below are of cumulus
///   bounds           name of the free form that holds the cloud; or
///   mesh             { file, scale, rotate_deg, translate }: a closed surface of triangles that does; or
///   center, size     where the preset's own form lies                    [m]
///   voxel_size       edge of a voxel                                     [m]     > 0; 0: by the limits
///   max_voxels       allowed in the bounding box                                 default 2^29
///   max_bytes        allowed for the grid in memory                      [bytes] default: no limit
///   noise.octaves    sizes of billows, each finer than the one before            1 .. 16, default 6
///   noise.frequency  of the coarsest billows                             [1/m]   >= 0, default 0: fitted to
///                    the free form's height
///   noise.lacunarity, noise.gain   frequency and amplitude factor per octave     1 .. 8, default 2;
///                                                                                0 .. 1, default 0.55
///   noise.seed       another number, another cloud                               >= 0, default 0
///   height_profile   [relative height, fullness] pairs, linear in between        0 .. 1, heights increase
///   edge             how far the fall-off reaches in, 1: up to the centre        0 .. 1, default 0.7
///   erosion          how deep the noise carves                                   0 .. 4, default 0.9
///   threshold        what is thinner than this is clear air                      0 .. 1, default 0.1
///   density_texture  name of a [texture.NAME]: its luminance times its opacity multiplies the density
///   sharpness        steepness of the edges; the density saturates at 1          1 .. 100, default 8
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

#include "lib/cloud/cloud_presets.h"
#include "lib/core/error.h"
#include "lib/freeform/free_form.h"
#include "lib/geom/mesh_distance.h"
#include "lib/geom/mesh_file.h"
#include "lib/math/luminance.h"
#include "vdb_io/load_openvdb.h"

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

std::shared_ptr<const MeshDistance> read_closed_mesh(const std::filesystem::path& file,
                                                     const Affine& world_from_mesh) {
  const MeshData mesh = read_mesh(file);
  try {
    return std::make_shared<const MeshDistance>(mesh, world_from_mesh);
  } catch (const Error& error) {
    throw Error(ErrorKind::file, file.string(), error.diagnostics().front().message);
  }
}

}  // namespace

void CloudVolume::describe_density(ParamTable& params) {
  params.reference("bounds", bounds, "freeform",
                   "the free form that holds the cloud; without it the preset has one");
  params.group(
      "mesh",
      [this](ParamTable& group) {
        group.file("file", mesh, "a closed surface of triangles: .obj, .ply, .gltf or .glb").required();
        mesh_placement.describe(group);
      },
      "a mesh that holds the cloud, instead of a free form");
  params.vector("center", center, "m", "middle of the preset's free form");
  params.vector("size", size, "m", "width, height and depth of the preset's free form").at_least(0);
  params.number("voxel_size", voxel_size, "m", "edge of a voxel; 0: as small as the limits allow")
      .at_least(0);
  params.number("max_voxels", max_voxels, "voxels", "allowed in the bounding box; 0: 2^29")
      .at_least(0)
      .at_most(1e12);
  params.number("max_bytes", max_bytes, "bytes", "allowed for the grid in memory; 0: no limit")
      .at_least(0)
      .at_most(1e15);
  recipe.describe(params);
  fields.describe(params);
  params.object("density_texture", density_texture,
                "its luminance times its opacity multiplies the density, averaged over a voxel");
}

void CloudVolume::commit(std::vector<std::string>& problems) {
  recipe.check(problems);
  const bool has_size = size.x > 0 && size.y > 0 && size.z > 0;
  const int bodies = (bounds.empty() ? 0 : 1) + (mesh.empty() ? 0 : 1) + (has_size ? 1 : 0);
  if (bodies == 0) {
    problems.push_back(
        "neither bounds nor size is given; expected the name of a free form, the size of the preset's own, "
        "or a "
        "mesh");
  }
  if (bodies > 1) problems.push_back("more than one of bounds, size and mesh is given; expected one of them");
  if (voxel_size == 0 && max_voxels == 0 && max_bytes == 0) {
    problems.push_back(
        "voxel_size is missing; expected a length, or a limit to choose it by: max_voxels or max_bytes");
  }
}

std::shared_ptr<const DensityField> CloudVolume::build(const FreeForms& freeforms) const {
  return load_openvdb().build_cloud_field(cloud(freeforms), grid_options());
}

ProceduralCloud CloudVolume::cloud(const FreeForms& freeforms) const {
  if (!mesh.empty()) {
    return {recipe, CloudBody(read_closed_mesh(mesh, mesh_placement.world_from_object())), density_map()};
  }
  return {recipe,
          bounds.empty() ? cloud_preset_form(recipe.preset, center, size) : find_free_form(freeforms, bounds),
          density_map()};
}

ProceduralCloud::DensityMap CloudVolume::density_map() const {
  if (!density_texture) return {};
  return [texture = density_texture](const Vec3d& p, double width) {
    const TextureValue value = texture->at({p, {0.0, 1.0, 0.0}, {width, 0.0, 0.0}, {0.0, 0.0, width}});
    return value.opacity * luminance(value.color);
  };
}

CloudGridOptions CloudVolume::grid_options() const {
  return {voxel_size, max_voxels > 0 ? int64_t(max_voxels) : kMaxVoxels, int64_t(max_bytes), {}};
}

PILEUS_PLUGIN(Medium, cloud, CloudVolume, "procedural cloud that billows inside a free form")

}  // namespace pileus
