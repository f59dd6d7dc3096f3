#include "vdb_io/density_rules.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "vdb_io/grid_choice.h"
#include "vdb_io/vdb_transform.h"

namespace pileus {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& message) {
  throw Error(ErrorKind::file, path.string(), message);
}

}  // namespace

const VdbGridEntry& choose_density(const std::filesystem::path& path, const VdbDirectory& directory,
                                   const VdbReadOptions& options, Notes& notes) {
  const VdbGridEntry& grid = choose_grid(path, directory, options.grid);
  const std::string& name = grid.name;
  if (options.grid.empty() && directory.grids.size() > 1) {
    notes.push_back(fmt::format("grid {} chosen among {}", describe(grid), directory.grids.size()));
  } else if (!options.grid.empty() && grid.base_name != options.grid && name != options.grid) {
    notes.push_back(fmt::format("grid {} taken for \"{}\"", describe(grid), options.grid));
  }
  const bool is_level_set = grid.grid_class == "level set";
  if (is_level_set && grid.is_scalar() && options.level_set == LevelSetPolicy::refuse) {
    fail(path,
         fmt::format(
             "grid \"{}\" is a level set (distances); expected a fog volume; write `level_set = \"fog\"` "
             "into its volume (for a bare file: --set volume.volume.level_set=fog) to fill its inside",
             name));
  }
  return grid;
}

FogOfLevelSet::FogOfLevelSet(const std::filesystem::path& path, const std::string& grid,
                             const ValueCounts& distances, float background, const Affine& world_from_index)
    : m_grid(grid) {
  constexpr double kBandInVoxels = 3.0;
  if (distances.nan + distances.infinite > 0) {
    fail(path,
         fmt::format("level set \"{}\" holds {} NaN and {} infinite distances; expected finite ones; repair "
                     "it where it was made",
                     grid, distances.nan, distances.infinite));
  }
  if (background < 0.0f || std::isnan(background)) {
    fail(path,
         fmt::format("level set \"{}\" has the background {}: all of space would be inside; expected one > 0",
                     grid, background));
  }
  const Vec3d edges = voxel_edges(world_from_index);
  m_band = kBandInVoxels * std::cbrt(edges.x * edges.y * edges.z);
}

float FogOfLevelSet::density(float distance) const {
  return std::clamp(-distance / float(m_band), 0.0f, 1.0f);
}

std::string FogOfLevelSet::note() const {
  return fmt::format("level set \"{}\" turned into fog: 0 at the surface, 1 from {:.4g} m inwards", m_grid,
                     m_band);
}

void accept_density(const std::filesystem::path& path, const VdbGridEntry& grid, uint64_t active_voxels,
                    float background, Notes& notes) {
  if (active_voxels == 0) {
    fail(path, fmt::format(
                   "grid \"{}\" is empty (0 active voxels); expected a density; choose another grid or frame",
                   grid.name));
  }
  if (grid.value_type != "float")
    notes.push_back(fmt::format("grid \"{}\" converted from {} to float", grid.name, grid.value_type));
  if (grid.grid_class == "unknown")
    notes.push_back(fmt::format("grid \"{}\" has no class; taken as a fog volume", grid.name));
  if (background != 0.0f) {
    fail(path,
         fmt::format(
             "grid \"{}\" has the background {}, which fills all of space; expected 0; set it to 0 where "
             "the grid was made",
             grid.name, background));
  }
}

bool must_clear_bad_values(const std::filesystem::path& path, const VdbGridEntry& grid, BadValuePolicy policy,
                           const ValueCounts& found, Notes& notes) {
  if (found.bad() == 0) return false;
  const std::string counts =
      fmt::format("{} NaN, {} infinite and {} negative values", found.nan, found.infinite, found.negative);
  if (policy == BadValuePolicy::refuse) {
    fail(path,
         fmt::format("grid \"{}\" holds {}; expected densities >= 0; repair it where it was made, or write "
                     "`nan = \"zero\"` to set them to 0",
                     grid.name, counts));
  }
  notes.push_back(fmt::format("grid \"{}\": {} set to 0", grid.name, counts));
  return true;
}

float cleared(float value) {
  return value >= 0.0f && !std::isinf(value) ? value : 0.0f;
}

}  // namespace pileus
