#include "vdb_io/inspect.h"

#include <algorithm>

#include "lib/core/error.h"
#include "vdb_io/columns.h"
#include "vdb_io/vdb_reader.h"

namespace pileus {
namespace {

ValueReport report_values(const std::filesystem::path& path, const GridReport& report,
                          const openvdb::FloatGrid& grid) {
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
    const auto columns = integrate_columns(grid, world_from_index(path, grid));
    if (columns) values.max_column = columns->max();
  }
  return values;
}

void warn_about_values(const GridReport& report, std::vector<std::string>& warnings) {
  const VdbGridEntry& entry = report.entry;
  const ValueReport& values = *report.values;
  const bool is_level_set = entry.grid_class == "level set";
  if (is_level_set) {
    warnings.push_back(
        "is a level set, not a density; write `level_set = \"fog\"` into its volume "
        "(for a bare file: --set volume.volume.level_set=fog) to fill its inside");
  }
  if (values.nan + values.infinite > 0 || (values.negative > 0 && !is_level_set)) {
    warnings.push_back(
        fmt::format("holds {} NaN, {} infinite and {} negative values; write `nan = \"zero\"` to set them to "
                    "0, or repair it",
                    values.nan, values.infinite, values.negative));
  }
  if (is_level_set) {
    if (values.max >= 1e4) {
      warnings.push_back(
          fmt::format("has distances up to {}, which mean \"far\"; they stay outside the fog", values.max));
    }
    return;
  }
  if (values.background != 0.0) {
    warnings.push_back(fmt::format(
        "has the background {}: it would fill all of space; set the background to 0", values.background));
  }
  if (values.inactive_nonzero > 0) {
    warnings.push_back(
        fmt::format("has {} inactive voxels that are not 0; they are interpolated like active ones",
                    values.inactive_nonzero));
  }
  if (entry.grid_class == "unknown") warnings.push_back("has no class; taken as a fog volume");
  if (values.max_column && *values.max_column > 0.0 && *values.max_column < 0.1) {
    warnings.push_back(fmt::format("is nearly invisible at extinction 1; try `extinction = {:.2g}`",
                                   5.0 / *values.max_column));
  }
}

void warn_about_size(const GridReport& report, std::vector<std::string>& warnings) {
  if (!report.voxel_size || !report.structure) return;
  const Box3i& box = report.structure->active_bounds;
  double extent = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    extent = std::max(extent, (double(box.max[axis]) - box.min[axis] + 1.0) * (*report.voxel_size)[axis]);
  }
  if (extent < 0.01 || extent > 1e5) {
    const double scale = 10.0 / extent;
    warnings.push_back(
        fmt::format("is {:.3g} m wide, which is unusual; if it was not meant in metres, write `scale = "
                    "[{:.4g}, {:.4g}, {:.4g}]` to make it 10 m",
                    extent, scale, scale, scale));
  }
}

void add_warnings(GridReport& report) {
  const VdbGridEntry& entry = report.entry;
  std::vector<std::string>& warnings = report.warnings;
  if (entry.value_type == "points") {
    warnings.push_back(
        "holds points, not a volume: pileus cannot show it; rasterize the points to a density first");
  } else if (!entry.is_scalar()) {
    warnings.push_back(
        fmt::format("holds {} values: pileus shows scalar grids only; name another with `grid = \"...\"`",
                    entry.value_type));
  }
  if (report.structure && report.structure->active_voxels == 0) {
    warnings.push_back("is empty (0 active voxels, so its bounding box is inverted); nothing to show");
    return;
  }
  if (report.values) warn_about_values(report, warnings);
  warn_about_size(report, warnings);
}

GridReport report_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                       const VdbGridEntry& entry) {
  GridReport report;
  report.entry = entry;
  try {
    report.structure = check_grid_structure(path, entry);
    if (entry.has_affine_map()) {
      report.voxel_size = voxel_edges(world_from_index(path, *read_grid_without_voxels(path, entry)));
    }
    if (entry.is_scalar())
      report.values = report_values(path, report, *read_scalar_grid(path, directory, entry));
  } catch (const Error& error) {
    report.problem = error.diagnostics().front().message;
    return report;
  }
  add_warnings(report);
  return report;
}

}  // namespace

VdbReport inspect_vdb(const std::filesystem::path& path, const std::string& grid) {
  VdbReport report;
  report.directory = read_vdb_directory(path);
  const VdbDirectory& directory = report.directory;
  if (directory.grids.empty()) report.warnings.push_back("the file holds no grids");
  try {
    const VdbGridEntry& chosen = choose_grid(path, directory, "");
    if (chosen.is_scalar() && chosen.grid_class != "level set") report.default_grid = chosen.name;
  } catch (const Error&) {
    if (!directory.grids.empty()) {
      report.warnings.push_back(
          "no grid is named \"density\" and several could be meant; a scene must choose with "
          "`grid = \"...\"`");
    }
  }
  if (!grid.empty()) {
    report.grids.push_back(report_grid(path, directory, choose_grid(path, directory, grid)));
    return report;
  }
  for (const VdbGridEntry& entry : directory.grids)
    report.grids.push_back(report_grid(path, directory, entry));
  return report;
}

}  // namespace pileus
