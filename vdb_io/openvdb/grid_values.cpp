#include "vdb_io/openvdb/grid_values.h"

#include <algorithm>
#include <vector>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "vdb_io/node_mask.h"

namespace pileus {
namespace {

/// The tiles of a node, or of the root.
template <class Node>
void add_tiles(ValueTally& tally, const Node& node) {
  for (auto tile = node.cbeginValueAll(); tile; ++tile)
    tally.add(*tile, tile.isValueOn(), Node::ChildNodeType::NUM_VOXELS);
}

}  // namespace

ValueCounts count_values(const openvdb::FloatGrid& grid) {
  using LeafNode = openvdb::FloatTree::LeafNodeType;
  constexpr size_t kLeavesPerTask = 256;
  std::vector<const LeafNode*> leaves;
  grid.tree().getNodes(leaves);
  std::vector<ValueTally> tallies((leaves.size() + kLeavesPerTask - 1) / kLeavesPerTask);
  parallel_for(tallies.size(), [&](size_t task) {
    const size_t end = std::min(leaves.size(), (task + 1) * kLeavesPerTask);
    for (size_t i = task * kLeavesPerTask; i < end; ++i) {
      LeafMask active;
      for (openvdb::Index w = 0; w < LeafNode::NodeMaskType::WORD_COUNT; ++w)
        active.words[w] = leaves[i]->getValueMask().getWord<uint64_t>(w);
      tallies[task].add_leaf(leaves[i]->buffer().data(), active.words.data());
    }
  });

  ValueTally total;
  // Iterators of nodes are several times as fast as those of the tree.
  using Upper = openvdb::FloatTree::RootNodeType::ChildNodeType;
  std::vector<const Upper*> uppers;
  std::vector<const Upper::ChildNodeType*> lowers;
  grid.tree().getNodes(uppers);
  grid.tree().getNodes(lowers);
  add_tiles(total, grid.tree().root());
  for (const auto* node : uppers) add_tiles(total, *node);
  for (const auto* node : lowers) add_tiles(total, *node);
  for (const ValueTally& tally : tallies) total.add(tally);
  return total.counts();
}

Affine world_from_index(const std::filesystem::path& path, const openvdb::GridBase& grid) {
  PILEUS_CHECK(grid.transform().isLinear());
  Imath::M44d matrix;
  try {
    const openvdb::Mat4R stored = grid.transform().baseMap()->getAffineMap()->getMat4();
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) matrix[i][j] = stored[i][j];
    }
  } catch (const openvdb::ArithmeticError&) {  // OpenVDB inverts it on the way
    refuse_transform(path, grid.getName(), "singular");
  }
  return checked_world_from_index(path, grid.getName(), matrix);
}

}  // namespace pileus
