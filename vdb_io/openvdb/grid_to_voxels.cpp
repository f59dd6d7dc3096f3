#include "vdb_io/openvdb/grid_to_voxels.h"

#include <vector>

#include "vdb_io/openvdb/grid_values.h"

namespace pileus {
namespace {

using openvdb::FloatTree;
using LeafNode = FloatTree::LeafNodeType;

Vec3i to_vec(const openvdb::Coord& p) {
  return {p.x(), p.y(), p.z()};
}

std::vector<GridVoxels::Leaf> leaves_of(FloatTree& tree) {
  std::vector<LeafNode*> nodes;
  tree.getNodes(nodes);
  std::vector<GridVoxels::Leaf> leaves;
  leaves.reserve(nodes.size());
  for (LeafNode* leaf : nodes) leaves.push_back({to_vec(leaf->origin()), leaf->buffer().data()});
  return leaves;
}

/// Constant tiles that are not 0, active or not: interpolation reads both.
std::vector<VoxelTile> tiles_of(const FloatTree& tree) {
  std::vector<VoxelTile> tiles;
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (*tile == 0.0f) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    tiles.push_back({to_vec(box.min()), box.dim().x(), *tile});
  }
  return tiles;
}

}  // namespace

GridVoxels voxels_of(openvdb::FloatGrid& grid) {
  GridVoxels voxels;
  voxels.leaves = leaves_of(grid.tree());
  voxels.tiles = tiles_of(grid.tree());
  voxels.background = grid.background();
  voxels.active_voxels = grid.activeVoxelCount();
  voxels.world_from_index = world_from_index({}, grid);
  return voxels;
}

}  // namespace pileus
