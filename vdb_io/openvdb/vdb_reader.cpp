#include "vdb_io/openvdb/vdb_reader.h"

#include <openvdb/io/File.h>

#include "lib/core/error.h"
#include "vdb_io/density_rules.h"
#include "vdb_io/openvdb/openvdb_library.h"
#include "vdb_io/openvdb/volume_file.h"
#include "vdb_io/vdb_tree.h"

namespace pileus {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& message) {
  throw Error(ErrorKind::file, path.string(), message);
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

/// Replaces every distance by the density of the filled surface.
void fill_inside(openvdb::FloatTree& tree, const FogOfLevelSet& fog) {
  for (auto leaf = tree.beginLeaf(); leaf; ++leaf) {
    for (auto voxel = leaf->beginValueAll(); voxel; ++voxel) {
      voxel.setValue(fog.density(*voxel));
      voxel.setValueOn(*voxel > 0.0f);
    }
  }
  auto tile = tree.beginValueAll();
  tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    tile.setValue(fog.density(*tile));
    tile.setActiveState(*tile > 0.0f);
  }
  tree.root().setBackground(0.0f, /*updateChildNodes=*/false);
}

void clear_bad_values(openvdb::FloatTree& tree) {
  const auto clear = [](auto iterator) {
    for (; iterator; ++iterator) iterator.setValue(cleared(*iterator));
  };
  for (auto leaf = tree.beginLeaf(); leaf; ++leaf) clear(leaf->beginValueAll());
  auto tiles = tree.beginValueAll();
  tiles.setMaxDepth(decltype(tiles)::LEAF_DEPTH - 1);
  clear(tiles);
}

}  // namespace

std::string turn_level_set_into_fog(const std::filesystem::path& path, openvdb::FloatGrid& grid) {
  const FogOfLevelSet fog(path, grid.getName(), count_values(grid), grid.background(),
                          world_from_index(path, grid));
  fill_inside(grid.tree(), fog);
  grid.setGridClass(openvdb::GRID_FOG_VOLUME);
  return fog.note();
}

openvdb::FloatGrid::Ptr as_float(const openvdb::GridBase::Ptr& grid) {
  if (auto same = openvdb::gridPtrCast<openvdb::FloatGrid>(grid)) return same;
  if (auto made = converted<openvdb::DoubleGrid>(grid)) return made;
  if (auto made = converted<openvdb::Int32Grid>(grid)) return made;
  if (auto made = converted<openvdb::Int64Grid>(grid)) return made;
  return converted<openvdb::BoolGrid>(grid);
}

openvdb::GridBase::Ptr read_vdb_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                     const VdbGridEntry& entry) {
  read_checked_tree(path, directory, entry);
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
  density.source = choose_density(path, directory, options, density.notes);
  density.grid = read_scalar_grid(path, directory, density.source);
  world_from_index(path, *density.grid);
  if (density.source.grid_class == "level set")
    density.notes.push_back(turn_level_set_into_fog(path, *density.grid));
  accept_density(path, density.source, density.grid->activeVoxelCount(), density.grid->background(),
                 density.notes);
  density.values = count_values(*density.grid);
  if (must_clear_bad_values(path, density.source, options.bad_values, density.values, density.notes))
    clear_bad_values(density.grid->tree());
  return density;
}

}  // namespace pileus
