#include "vdb_io/openvdb/grid_to_field.h"

#include <vector>

#include "lib/core/error.h"
#include "vdb_io/density_voxels.h"
#include "vdb_io/openvdb/grid_values.h"
#include "vdb_io/openvdb/openvdb_library.h"

namespace pileus {
namespace {

using openvdb::FloatTree;
using LeafNode = FloatTree::LeafNodeType;

Vec3i to_vec(const openvdb::Coord& p) {
  return {p.x(), p.y(), p.z()};
}

std::vector<VoxelLeaf> leaves_of(const FloatTree& tree) {
  std::vector<const LeafNode*> nodes;
  tree.getNodes(nodes);
  std::vector<VoxelLeaf> leaves;
  leaves.reserve(nodes.size());
  for (const LeafNode* leaf : nodes) leaves.push_back({to_vec(leaf->origin()), leaf->buffer().data()});
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

std::shared_ptr<const DensityField> field_from_grid(openvdb::FloatGrid::ConstPtr grid,
                                                    const Affine& world_from_object) {
  initialize_openvdb();
  PILEUS_CHECK(grid->background() == 0.0f);
  return place_field(VoxelSource(leaves_of(grid->tree()), tiles_of(grid->tree()), grid),
                     world_from_index({}, *grid), world_from_object);
}

}  // namespace pileus
