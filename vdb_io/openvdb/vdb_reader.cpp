#include "vdb_io/openvdb/vdb_reader.h"

#include <algorithm>
#include <cmath>

#include <openvdb/io/File.h>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "vdb_io/grid_aliases.h"
#include "vdb_io/openvdb/openvdb_library.h"
#include "vdb_io/openvdb/volume_file.h"
#include "vdb_io/vdb_structure.h"

namespace pileus {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& message) {
  throw Error(ErrorKind::file, path.string(), message);
}

std::string list_grids(const std::vector<const VdbGridEntry*>& grids) {
  std::string text;
  for (const VdbGridEntry* grid : grids) text += (text.empty() ? "" : ", ") + describe(*grid);
  return text.empty() ? "none" : text;
}

std::vector<const VdbGridEntry*> grids_where(const VdbDirectory& directory, auto predicate) {
  std::vector<const VdbGridEntry*> found;
  for (const VdbGridEntry& grid : directory.grids) {
    if (predicate(grid)) found.push_back(&grid);
  }
  return found;
}

bool is_fog(const VdbGridEntry& grid) {
  return grid.is_scalar() && (grid.grid_class == "fog volume" || grid.grid_class == "unknown");
}

const VdbGridEntry& find_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                              const std::string& wanted) {
  std::vector<std::string> names;
  for (const VdbGridEntry& grid : directory.grids) {
    if (grid.name == wanted) return grid;
    names.push_back(grid.name);
  }
  const auto same_base = grids_where(directory, [&](const auto& grid) { return grid.base_name == wanted; });
  if (same_base.size() == 1) return *same_base.front();
  if (same_base.size() > 1) {
    fail(path, fmt::format("{} grids are called \"{}\"; expected one of them by number: {}", same_base.size(),
                           wanted, list_grids(same_base)));
  }
  const auto aliases =
      grids_where(directory, [&](const auto& grid) { return means_the_same(grid.base_name, wanted); });
  if (aliases.size() == 1) return *aliases.front();
  const std::string nearest = nearest_name(wanted, names);
  fail(path, fmt::format("no grid \"{}\"; found {}{}", wanted,
                         list_grids(grids_where(directory, [](const auto&) { return true; })),
                         nearest.empty() ? "" : "; nearest: " + nearest));
}

/// Turns away what is not a scalar grid, with what it is good for.
void require_scalar(const std::filesystem::path& path, const VdbGridEntry& grid) {
  if (grid.is_scalar()) return;
  if (grid.value_type == "points") {
    fail(path,
         fmt::format(
             "grid \"{}\" holds points, not a volume; expected a scalar grid; rasterize the points to a "
             "density first (Houdini: VDB from Particles; Blender: Points to Volume)",
             grid.name));
  }
  if (grid.value_type.starts_with("vec")) {
    fail(path,
         fmt::format(
             "grid \"{}\" holds vectors ({}{}); expected a scalar grid; name one with `grid = \"...\"`, or "
             "write its length or one component as a float grid",
             grid.name, grid.value_type, grid.grid_class == "staggered" ? ", staggered" : ""));
  }
  fail(path, fmt::format("grid \"{}\" holds values of type {}; expected float, double, int32, int64 or bool",
                         grid.name, grid.value_type));
}

/// The entry whose voxels `entry` shows: itself, or the grid it shares its tree with.
const VdbGridEntry& voxel_owner(const std::filesystem::path& path, const VdbDirectory& directory,
                                const VdbGridEntry& entry) {
  if (entry.shares_tree_with.empty()) return entry;
  for (const VdbGridEntry& grid : directory.grids) {
    const bool is_owner = grid.name == entry.shares_tree_with && grid.shares_tree_with.empty();
    if (is_owner && grid.tree_type == entry.tree_type) return grid;
  }
  fail(path, fmt::format("is damaged: grid \"{}\" shares its voxels with \"{}\", which has none of that type",
                         entry.name, entry.shares_tree_with));
}

/// Turns away what check_grid_structure does not cover, or cannot be placed.
void require_affine(const std::filesystem::path& path, const VdbGridEntry& grid) {
  if (grid.has_affine_map()) return;
  fail(path,
       fmt::format(
           "grid \"{}\" has the transform {} ({}); expected an affine one; resample it to a box where it "
           "was made",
           grid.name, grid.map_type,
           grid.map_type == "NonlinearFrustumMap" ? "a frustum: voxels widen with distance" : "unknown"));
}

/// Turns away what would take more memory than allowed, before any of it is taken.
void require_tree_memory(const std::filesystem::path& path, const VdbGridEntry& grid,
                         const GridStructure& structure) {
  uint64_t needed = structure.memory_bytes;
  if (grid.is_scalar() && grid.value_type != "float")
    needed += structure.leaves * sizeof(float) * 512;  // a copy
  require_memory(path.string(), fmt::format("grid \"{}\"", grid.name), needed);
}

/// Opens the file with OpenVDB and turns whatever it throws into an Error.
template <class Read>
openvdb::GridBase::Ptr read_with_openvdb(const std::filesystem::path& path, const VdbGridEntry& entry,
                                         const Read& read) {
  initialize_openvdb();
  try {
    // No delayed loading: all voxels are wanted at once, and a mapped file that shrinks would kill the
    // process.
    openvdb::io::File file(path.string());
    file.open(/*delayLoad=*/false);
    return read(file);
  } catch (const std::bad_alloc&) {
    fail(path, fmt::format("grid \"{}\" does not fit into memory", entry.name));
  } catch (const std::exception& problem) {
    fail(path, fmt::format("OpenVDB cannot read grid \"{}\": {}", entry.name, problem.what()));
  }
}

template <class Grid>
openvdb::FloatGrid::Ptr converted(const openvdb::GridBase::Ptr& grid) {
  const auto typed = openvdb::gridPtrCast<Grid>(grid);
  return typed ? std::make_shared<openvdb::FloatGrid>(*typed) : nullptr;
}

/// Replaces every distance by the density of the filled surface: 0 outside and on it, 1 from `band` inwards.
void fill_inside(openvdb::FloatTree& tree, float band) {
  const auto density = [&](float distance) { return std::clamp(-distance / band, 0.0f, 1.0f); };
  for (auto leaf = tree.beginLeaf(); leaf; ++leaf) {
    for (auto voxel = leaf->beginValueAll(); voxel; ++voxel) {
      voxel.setValue(density(*voxel));
      voxel.setValueOn(*voxel > 0.0f);
    }
  }
  auto tile = tree.beginValueAll();
  tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    tile.setValue(density(*tile));
    tile.setActiveState(*tile > 0.0f);
  }
  tree.root().setBackground(0.0f, /*updateChildNodes=*/false);
}

void refuse_or_clear_bad_values(const std::filesystem::path& path, BadValuePolicy policy,
                                DensityGrid& density) {
  const ValueCounts& found = density.values;
  if (found.bad() == 0) return;
  const std::string counts =
      fmt::format("{} NaN, {} infinite and {} negative values", found.nan, found.infinite, found.negative);
  if (policy == BadValuePolicy::refuse) {
    fail(path,
         fmt::format("grid \"{}\" holds {}; expected densities >= 0; repair it where it was made, or write "
                     "`nan = \"zero\"` to set them to 0",
                     density.source.name, counts));
  }
  const auto clear = [](auto iterator) {
    for (; iterator; ++iterator) {
      const float value = *iterator;
      if (!(value >= 0.0f) || std::isinf(value)) iterator.setValue(0.0f);
    }
  };
  auto& tree = density.grid->tree();
  for (auto leaf = tree.beginLeaf(); leaf; ++leaf) clear(leaf->beginValueAll());
  auto tiles = tree.beginValueAll();
  tiles.setMaxDepth(decltype(tiles)::LEAF_DEPTH - 1);
  clear(tiles);
  density.notes.push_back(fmt::format("grid \"{}\": {} set to 0", density.source.name, counts));
}

}  // namespace

std::string turn_level_set_into_fog(const std::filesystem::path& path, openvdb::FloatGrid& grid) {
  constexpr double kBandInVoxels = 3.0;
  const ValueCounts distances = count_values(grid);
  if (distances.nan + distances.infinite > 0) {
    fail(path,
         fmt::format("level set \"{}\" holds {} NaN and {} infinite distances; expected finite ones; repair "
                     "it where it was made",
                     grid.getName(), distances.nan, distances.infinite));
  }
  if (grid.background() < 0.0f || std::isnan(grid.background())) {
    fail(path,
         fmt::format("level set \"{}\" has the background {}: all of space would be inside; expected one > 0",
                     grid.getName(), grid.background()));
  }
  const Vec3d edges = voxel_edges(world_from_index(path, grid));
  const double band = kBandInVoxels * std::cbrt(edges.x * edges.y * edges.z);
  fill_inside(grid.tree(), float(band));
  grid.setGridClass(openvdb::GRID_FOG_VOLUME);
  return fmt::format("level set \"{}\" turned into fog: 0 at the surface, 1 from {:.4g} m inwards",
                     grid.getName(), band);
}

openvdb::FloatGrid::Ptr as_float(const openvdb::GridBase::Ptr& grid) {
  if (auto same = openvdb::gridPtrCast<openvdb::FloatGrid>(grid)) return same;
  if (auto made = converted<openvdb::DoubleGrid>(grid)) return made;
  if (auto made = converted<openvdb::Int32Grid>(grid)) return made;
  if (auto made = converted<openvdb::Int64Grid>(grid)) return made;
  return converted<openvdb::BoolGrid>(grid);
}

const VdbGridEntry& choose_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                const std::string& wanted) {
  if (!wanted.empty()) return find_grid(path, directory, wanted);
  if (directory.grids.empty()) fail(path, "holds no grids");
  const auto named_density =
      grids_where(directory, [](const auto& grid) { return grid.base_name == "density"; });
  if (named_density.size() == 1) return *named_density.front();
  const auto aliases = grids_where(
      directory, [](const auto& grid) { return is_fog(grid) && means_the_same(grid.base_name, "density"); });
  if (aliases.size() == 1) return *aliases.front();
  const auto fogs = grids_where(directory, is_fog);
  if (fogs.size() == 1) return *fogs.front();
  const auto scalars = grids_where(directory, [](const auto& grid) { return grid.is_scalar(); });
  if (directory.grids.size() == 1)
    return directory.grids.front();  // its own error will say what is wrong with it
  fail(path, fmt::format(
                 "no grid is named \"density\" and {} could be meant; found {}; choose with `grid = \"...\"`",
                 scalars.empty() ? "none" : "several",
                 list_grids(grids_where(directory, [](const auto&) { return true; }))));
}

openvdb::GridBase::Ptr read_vdb_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                     const VdbGridEntry& entry) {
  require_affine(path, entry);
  const auto structure = check_grid_structure(path, voxel_owner(path, directory, entry));
  if (!structure)
    fail(path, fmt::format("grid \"{}\" holds values of type {}", entry.name, entry.value_type));
  require_tree_memory(path, entry, *structure);
  return read_with_openvdb(path, entry, [&](auto& file) { return file.readGrid(entry.name); });
}

openvdb::MetaMap read_vdb_metadata(const std::filesystem::path& path) {
  read_vdb_directory(path);
  initialize_openvdb();
  try {
    openvdb::io::File file(path.string());
    file.open(/*delayLoad=*/false);
    return *file.getMetadata();
  } catch (const std::exception& problem) {
    fail(path, fmt::format("OpenVDB cannot read its metadata: {}", problem.what()));
  }
}

openvdb::FloatGrid::Ptr read_scalar_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                         const VdbGridEntry& entry) {
  require_scalar(path, entry);
  auto grid = as_float(read_volume_grid(path, directory, entry));
  if (!grid)
    fail(path, fmt::format("grid \"{}\" is not of the type {} it claims", entry.name, entry.value_type));
  return grid;
}

openvdb::GridBase::Ptr read_grid_without_voxels(const std::filesystem::path& path,
                                                const VdbGridEntry& entry) {
  return read_with_openvdb(path, entry, [&](auto& file) { return file.readGridMetadata(entry.name); });
}

DensityGrid read_density_grid(const std::filesystem::path& path, const VdbReadOptions& options) {
  const VdbDirectory directory = read_volume_directory(path);
  DensityGrid density;
  density.source = choose_grid(path, directory, options.grid);
  const std::string& name = density.source.name;
  if (options.grid.empty() && directory.grids.size() > 1) {
    density.notes.push_back(
        fmt::format("grid {} chosen among {}", describe(density.source), directory.grids.size()));
  } else if (!options.grid.empty() && density.source.base_name != options.grid && name != options.grid) {
    density.notes.push_back(fmt::format("grid {} taken for \"{}\"", describe(density.source), options.grid));
  }
  const bool is_level_set = density.source.grid_class == "level set";
  if (is_level_set && density.source.is_scalar() && options.level_set == LevelSetPolicy::refuse) {
    fail(path,
         fmt::format(
             "grid \"{}\" is a level set (distances); expected a fog volume; write `level_set = \"fog\"` "
             "into its volume (for a bare file: --set volume.volume.level_set=fog) to fill its inside",
             name));
  }

  density.grid = read_scalar_grid(path, directory, density.source);
  world_from_index(path, *density.grid);
  if (is_level_set) density.notes.push_back(turn_level_set_into_fog(path, *density.grid));
  if (density.grid->activeVoxelCount() == 0) {
    fail(path, fmt::format(
                   "grid \"{}\" is empty (0 active voxels); expected a density; choose another grid or frame",
                   name));
  }
  if (density.source.value_type != "float") {
    density.notes.push_back(
        fmt::format("grid \"{}\" converted from {} to float", name, density.source.value_type));
  }
  if (density.source.grid_class == "unknown") {
    density.notes.push_back(fmt::format("grid \"{}\" has no class; taken as a fog volume", name));
  }

  if (density.grid->background() != 0.0f) {
    fail(path,
         fmt::format(
             "grid \"{}\" has the background {}, which fills all of space; expected 0; set it to 0 where "
             "the grid was made",
             name, density.grid->background()));
  }
  density.values = count_values(*density.grid);
  refuse_or_clear_bad_values(path, options.bad_values, density);
  return density;
}

}  // namespace pileus
