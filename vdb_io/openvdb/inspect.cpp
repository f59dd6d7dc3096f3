#include "vdb_io/inspect.h"

#include <algorithm>
#include <cmath>

#include "lib/core/error.h"
#include "vdb_io/columns.h"
#include "vdb_io/diagnose.h"
#include "vdb_io/openvdb/grid_to_voxels.h"
#include "vdb_io/openvdb/vdb_reader.h"
#include "vdb_io/openvdb/volume_file.h"

namespace pileus {
namespace {

ValueReport report_values(const GridReport& report, openvdb::FloatGrid& grid) {
  const ValueCounts counts = count_values(grid);
  ValueReport values;
  values.background = grid.background();
  values.min = counts.min;
  values.max = counts.max;
  values.nan = counts.nan;
  values.infinite = counts.infinite;
  values.negative = counts.negative;
  values.inactive_nonzero = counts.inactive_nonzero;
  values.memory_bytes = grid.memUsage();
  if (report.entry.grid_class != "level set") {
    const auto columns = integrate_columns(voxels_of(grid));
    if (columns) values.max_column = columns->max();
  }
  return values;
}

template <class Grid>
VectorReport count_vectors(const Grid& grid) {
  VectorReport report;
  report.memory_bytes = grid.memUsage();
  for (auto value = grid.cbeginValueAll(); value; ++value) {
    const auto& v = *value;
    const uint64_t voxels = value.getVoxelCount();
    if (std::isnan(v.x()) || std::isnan(v.y()) || std::isnan(v.z())) {
      report.nan += voxels;
    } else if (std::isinf(v.x()) || std::isinf(v.y()) || std::isinf(v.z())) {
      report.infinite += voxels;
    } else if (value.isValueOn()) {
      report.max_length =
          std::max(report.max_length, std::hypot(double(v.x()), double(v.y()), double(v.z())));
    }
  }
  return report;
}

std::optional<VectorReport> report_vectors(const openvdb::GridBase& grid) {
  using openvdb::Vec3DGrid, openvdb::Vec3SGrid;
  if (grid.isType<Vec3SGrid>()) return count_vectors(static_cast<const Vec3SGrid&>(grid));
  if (grid.isType<Vec3DGrid>()) return count_vectors(static_cast<const Vec3DGrid&>(grid));
  return std::nullopt;
}

/// The tree of a grid in memory, as check_grid_structure would find it in a file.
GridStructure structure_of(const openvdb::GridBase& base) {
  GridStructure structure;
  const openvdb::TreeBase& tree = base.constBaseTree();
  structure.active_voxels = tree.activeVoxelCount();
  structure.active_tiles = tree.activeTileCount();
  structure.leaves = tree.leafCount();
  structure.internal_nodes = tree.nonLeafCount() - 1;  // without the root
  const openvdb::CoordBBox box = base.evalActiveVoxelBoundingBox();
  if (!box.empty()) {
    structure.active_bounds.extendBy(Vec3i(box.min().x(), box.min().y(), box.min().z()));
    structure.active_bounds.extendBy(Vec3i(box.max().x(), box.max().y(), box.max().z()));
  }
  return structure;
}

/// Formats other than .vdb: the grid is read as a whole, then looked at.
void report_read_grid(const std::filesystem::path& path, const VdbDirectory& directory, GridReport& report) {
  const openvdb::GridBase::Ptr grid = read_volume_grid(path, directory, report.entry);
  report.structure = structure_of(*grid);
  report.voxel_size = voxel_edges(world_from_index(path, *grid));
  if (const openvdb::FloatGrid::Ptr scalar = as_float(grid))
    report.values = report_values(report, *scalar);
}

GridReport report_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                       const VdbGridEntry& entry) {
  GridReport report;
  report.entry = entry;
  try {
    if (volume_format(path) != VolumeFormat::vdb) {
      report_read_grid(path, directory, report);
      return report;
    }
    report.structure = check_grid_structure(path, entry);
    if (entry.has_affine_map()) {
      report.voxel_size = voxel_edges(world_from_index(path, *read_grid_without_voxels(path, entry)));
    }
    if (entry.is_scalar())
      report.values = report_values(report, *read_scalar_grid(path, directory, entry));
    if (entry.value_type == "vec3s" || entry.value_type == "vec3d")
      report.vectors = report_vectors(*read_vdb_grid(path, directory, entry));
  } catch (const Error& error) {
    report.problem = error.diagnostics().front().message;
  }
  return report;
}

/// What a scene without `grid` shows; "" where it must choose, or where that is no density.
std::string default_grid_of(const std::filesystem::path& path, const VdbDirectory& directory) {
  try {
    const VdbGridEntry& chosen = choose_grid(path, directory, "");
    return chosen.is_scalar() && chosen.grid_class != "level set" ? chosen.name : "";
  } catch (const Error&) {
    return "";
  }
}

}  // namespace

VdbReport inspect_vdb(const std::filesystem::path& path, const std::string& grid) {
  VdbReport report;
  report.directory = read_volume_directory(path);
  const VdbDirectory& directory = report.directory;
  report.default_grid = default_grid_of(path, directory);
  if (!grid.empty()) {
    report.grids.push_back(report_grid(path, directory, choose_grid(path, directory, grid)));
  } else {
    for (const VdbGridEntry& entry : directory.grids)
      report.grids.push_back(report_grid(path, directory, entry));
  }
  report.findings = find_trouble(path, report);
  return report;
}

}  // namespace pileus
