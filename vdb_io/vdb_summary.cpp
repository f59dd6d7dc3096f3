#include "vdb_io/vdb_summary.h"

#include "vdb_io/columns.h"
#include "vdb_io/density_voxels.h"
#include "vdb_io/vdb_transform.h"

namespace pileus {
namespace {

/// World box of index-space voxels, each half a voxel wide about its centre.
Box3d world_box(const Box3i& voxels, const Affine& world_from_index) {
  Box3d box;
  for (int n = 0; n < 8; ++n) {
    Vec3d corner;
    for (int axis = 0; axis < 3; ++axis)
      corner[axis] = (n >> axis & 1) != 0 ? voxels.max[axis] + 0.5 : voxels.min[axis] - 0.5;
    box.extendBy(world_from_index.point(corner));
  }
  return box;
}

/// Of leaves and tiles: some eight voxels too wide.
Box3i rough_bounds(const GridVoxels& voxels) {
  Box3i box;
  for (const GridVoxels::Leaf& leaf : voxels.leaves) {
    box.extendBy(leaf.origin);
    box.extendBy(leaf.origin + Vec3i(7));
  }
  for (const VoxelTile& tile : voxels.tiles) {
    box.extendBy(tile.origin);
    box.extendBy(tile.origin + Vec3i(tile.size - 1));
  }
  return box;
}

}  // namespace

GridSummary summarize_density(const std::filesystem::path& path, const std::string& grid) {
  const DensityVoxels density = read_density(path, {grid, LevelSetPolicy::to_fog, BadValuePolicy::to_zero});
  const GridVoxels& voxels = density.voxels;
  const std::optional<Columns> columns = integrate_columns(voxels);
  Box3i bounds = columns ? columns->bounds : rough_bounds(voxels);
  if (bounds.isEmpty()) bounds = Box3i(Vec3i(0));  // zeros everywhere, though active
  GridSummary summary;
  summary.grid = density.source.name;
  summary.bounds = world_box(bounds, voxels.world_from_index);
  summary.voxel_size = voxel_edges(voxels.world_from_index);
  summary.max_density = voxels.counts.max;
  if (columns) summary.typical_column = columns->quantile(0.95);
  summary.notes = density.notes;
  return summary;
}

}  // namespace pileus
