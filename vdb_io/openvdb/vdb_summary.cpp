#include "vdb_io/vdb_summary.h"

#include "vdb_io/openvdb/columns.h"
#include "vdb_io/openvdb/vdb_reader.h"

namespace pileus {
namespace {

/// World box of index-space voxels, each half a voxel wide about its centre.
Box3d world_box(const openvdb::CoordBBox& voxels, const Affine& world_from_index) {
  Box3d box;
  for (int n = 0; n < 8; ++n) {
    Vec3d corner;
    for (int axis = 0; axis < 3; ++axis) {
      corner[axis] = (n >> axis & 1) != 0 ? voxels.max()[axis] + 0.5 : voxels.min()[axis] - 0.5;
    }
    box.extendBy(world_from_index.point(corner));
  }
  return box;
}

}  // namespace

GridSummary summarize_density(const std::filesystem::path& path, const std::string& grid) {
  const DensityGrid density =
      read_density_grid(path, {grid, LevelSetPolicy::to_fog, BadValuePolicy::to_zero});
  const Affine to_world = world_from_index(path, *density.grid);
  GridSummary summary;
  summary.grid = density.source.name;
  summary.bounds = world_box(density.grid->evalActiveVoxelBoundingBox(), to_world);
  summary.voxel_size = voxel_edges(to_world);
  summary.max_density = density.values.max;
  if (const auto columns = integrate_columns(*density.grid, to_world)) {
    summary.typical_column = columns->quantile(0.95);
  }
  summary.notes = density.notes;
  return summary;
}

}  // namespace pileus
