#pragma once

#include <filesystem>

#include "vdb_io/tree_layout.h"

namespace pileus {

/// The entry whose voxels `entry` shows: itself, or the grid it shares its tree with. Throws Error(file).
const VdbGridEntry& voxel_owner(const std::filesystem::path& path, const VdbDirectory& directory,
                                const VdbGridEntry& entry);

/// The tree behind a grid, which another grid of the file may hold: checked, and found to fit into memory.
///   entry: of `directory`, which is read_vdb_directory(path)
/// errors: Error(file) for damaged files, types of values that read_tree_layout does not know, transforms
/// that
///         are not affine, trees larger than memory_budget()
TreeLayout read_checked_tree(const std::filesystem::path& path, const VdbDirectory& directory,
                             const VdbGridEntry& entry);

}  // namespace pileus
