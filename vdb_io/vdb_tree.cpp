#include "vdb_io/vdb_tree.h"

#include <utility>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"

namespace pileus {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& message) {
  throw Error(ErrorKind::file, path.string(), message);
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

}  // namespace

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

TreeLayout read_checked_tree(const std::filesystem::path& path, const VdbDirectory& directory,
                             const VdbGridEntry& entry) {
  require_affine(path, entry);
  auto layout = read_tree_layout(path, voxel_owner(path, directory, entry));
  if (!layout) fail(path, fmt::format("grid \"{}\" holds values of type {}", entry.name, entry.value_type));
  require_tree_memory(path, entry, layout->structure);
  return std::move(*layout);
}

}  // namespace pileus
