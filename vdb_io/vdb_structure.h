#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "lib/math/vec.h"
#include "vdb_io/vdb_directory.h"

namespace pileus {

/// The tree of one grid as counted in the file: exact, though no value has been unpacked.
struct GridStructure {
  uint64_t active_voxels = 0;  ///< active tiles count with all their voxels
  uint64_t active_tiles = 0;
  uint64_t leaves = 0;
  uint64_t internal_nodes = 0;
  uint64_t memory_bytes = 0;  ///< that OpenVDB needs to hold the tree
  Box3i active_bounds;  ///< index box of the active voxels, both ends inclusive; empty where there are none
};

/// Walks the tree and the voxel blocks of a grid in the file and checks what OpenVDB takes on trust: that
/// every node lies where it must, that masks do not contradict each other, and that each block's packed and
/// unpacked sizes are those of its buffer (OpenVDB 10 reads an unpacked block of any size into a leaf's 512
/// values). After it, memory for reading the grid is known; it is at most some 35 times the size of the file.
///   grid: an entry of read_vdb_directory(path) that holds voxels itself (shares_tree_with is "")
/// returns: nothing for trees whose layout is not known here (points, strings, masks), and behind
///          frustum transforms
/// errors: Error(file), one line
std::optional<GridStructure> check_grid_structure(const std::filesystem::path& path,
                                                  const VdbGridEntry& grid);

}  // namespace pileus
