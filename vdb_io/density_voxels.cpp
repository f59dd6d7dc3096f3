#include "vdb_io/density_voxels.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/volume/grid_field.h"
#include "vdb_io/density_rules.h"
#include "vdb_io/grid_choice.h"
#include "vdb_io/load_openvdb.h"
#include "vdb_io/vdb_voxels.h"
#include "vdb_io/volume_format.h"

namespace pileus {
namespace {

/// Replaces every value by what `change` makes of it, and what is known about them with it.
template <class Change>
void change_values(GridVoxels& voxels, const Change& change) {
  constexpr size_t kLeafVoxels = 512, kLeavesPerTask = 64;
  const auto& leaves = voxels.leaves;
  parallel_for((leaves.size() + kLeavesPerTask - 1) / kLeavesPerTask, [&](size_t task) {
    const size_t end = std::min(leaves.size(), (task + 1) * kLeavesPerTask);
    for (size_t i = task * kLeavesPerTask; i < end; ++i)
      std::transform(leaves[i].values, leaves[i].values + kLeafVoxels, leaves[i].values, change);
  });
  for (VoxelTile& tile : voxels.tiles) tile.value = change(tile.value);
  std::erase_if(voxels.tiles, [](const VoxelTile& tile) { return tile.value == 0.0f; });
  voxels.scan = {};
}

/// After a level set has become fog, what is not 0 is active.
void count_fog(GridVoxels& voxels) {
  ValueTally tally;
  voxels.active_voxels = 0;
  const auto add = [&](float value, uint64_t count) {
    if (!(value > 0.0f)) return;
    tally.add(value, true, count);
    voxels.active_voxels += count;
  };
  for (const GridVoxels::Leaf& leaf : voxels.leaves) {
    for (int n = 0; n < 512; ++n) add(leaf.values[n], 1);
  }
  for (const VoxelTile& tile : voxels.tiles)
    add(tile.value, uint64_t(tile.size) * uint64_t(tile.size) * uint64_t(tile.size));
  voxels.counts = tally.counts();
}

}  // namespace

DensityVoxels read_density_voxels(const std::filesystem::path& path, const VdbReadOptions& options) {
  const VdbDirectory directory = read_vdb_directory(path);
  DensityVoxels density;
  density.source = choose_density(path, directory, options, density.notes);
  const VdbGridEntry& source = density.source;
  require_scalar(path, source);
  density.voxels = read_vdb_voxels(path, directory, source);
  GridVoxels& voxels = density.voxels;
  if (source.grid_class == "level set") {
    const FogOfLevelSet fog(path, source.base_name, voxels.counts, voxels.background,
                            voxels.world_from_index);
    change_values(voxels, [&](float distance) { return fog.density(distance); });
    voxels.background = 0.0f;
    count_fog(voxels);
    density.notes.push_back(fog.note());
  }
  accept_density(path, source, voxels.active_voxels, voxels.background, density.notes);
  if (must_clear_bad_values(path, source, options.bad_values, voxels.counts, density.notes))
    change_values(voxels, cleared);
  return density;
}

DensityVoxels read_density(const std::filesystem::path& path, const VdbReadOptions& options) {
  if (volume_format(path) == VolumeFormat::vdb) return read_density_voxels(path, options);
  return load_openvdb().read_density(path, options);
}

std::shared_ptr<const DensityField> field_from_voxels(const GridVoxels& voxels,
                                                      const Affine& world_from_object) {
  PILEUS_CHECK(voxels.background == 0.0f);
  std::vector<VoxelLeaf> leaves;
  leaves.reserve(voxels.leaves.size());
  for (const GridVoxels::Leaf& leaf : voxels.leaves) leaves.push_back({leaf.origin, leaf.values});
  return place_field(VoxelSource(std::move(leaves), voxels.tiles, voxels.owner, voxels.scan),
                     voxels.world_from_index, world_from_object);
}

std::shared_ptr<const DensityField> place_field(VoxelSource voxels, const Affine& world_from_index,
                                                const Affine& world_from_object) {
  const Affine world_from_grid = world_from_object * world_from_index;
  const double volume = world_from_grid.determinant();
  if (!(std::abs(volume) > 1e-200 && std::abs(volume) < 1e200)) {
    throw Error(
        ErrorKind::scene, SourceLoc{},
        fmt::format("its placement makes voxels of {} m3; expected a scale that a computer can invert",
                    volume));
  }
  return make_grid_field(std::move(voxels), world_from_grid);
}

}  // namespace pileus
