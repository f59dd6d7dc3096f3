#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "lib/math/vec.h"
#include "vdb_io/node_mask.h"
#include "vdb_io/vdb_structure.h"

namespace pileus {

/// Where the values of a node lie in the file [bytes]: what inactive ones look like, then the block of
/// values.
struct ValueBlock {
  uint64_t begin = 0, end = 0;
};

struct LeafLayout {
  Vec3i origin;
  LeafMask active;
  ValueBlock values;  ///< in a grid of bools: 64 bytes, a bit for each voxel
};

/// A node above the leaves; those just below the root have 32^3 children of 128^3 voxels, the others 16^3 of
/// 8^3.
struct NodeLayout {
  Vec3i origin;
  int child_size;                          ///< edge of a child or tile [voxels]
  std::vector<uint64_t> children, active;  ///< masks as in the file; what is no child is a tile
  ValueBlock values;
};

struct RootTileLayout {
  Vec3i origin;
  bool is_active;
  uint64_t value;  ///< where it lies in the file
};

/// The tree of one grid as it lies in the file.
struct TreeLayout {
  GridStructure structure;
  uint64_t background = 0;  ///< where it lies in the file
  std::vector<RootTileLayout> root_tiles;
  std::vector<NodeLayout> nodes;   ///< in the order of the file: a node before its children
  std::vector<LeafLayout> leaves;  ///< in the order of the file, which is that of the tree
};

/// What check_grid_structure finds, with the places where values lie. Nothing and errors: as there.
std::optional<TreeLayout> read_tree_layout(const std::filesystem::path& path, const VdbGridEntry& grid);

}  // namespace pileus
