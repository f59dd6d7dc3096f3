#include "vdb_io/vdb_summary.h"

#include "lib/math/box.h"
#include "vdb_io/columns.h"
#include "vdb_io/density_voxels.h"
#include "vdb_io/vdb_transform.h"

namespace pileus {
namespace {

/// World box of index-space voxels, each half a voxel wide about its centre.
Box3d world_box(const Box3i& voxels, const Affine& world_from_index) {
  return box_around(world_from_index, {Vec3d(voxels.min) - Vec3d(0.5), Vec3d(voxels.max) + Vec3d(0.5)});
}

}  // namespace

GridSummary summarize_density(const std::filesystem::path& path, const std::string& grid) {
  const DensityVoxels density = read_density(path, {grid, LevelSetPolicy::to_fog, BadValuePolicy::to_zero});
  const GridVoxels& voxels = density.voxels;
  const std::optional<Columns> columns = integrate_columns(voxels);
  Box3i bounds = columns ? columns->bounds : box_of(voxels);
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
