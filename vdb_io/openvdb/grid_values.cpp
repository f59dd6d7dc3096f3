#include "vdb_io/openvdb/grid_values.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "lib/core/error.h"
#include "lib/core/parallel.h"

namespace pileus {
namespace {

/// Counts under way; min and max start beyond every value.
struct Tally {
  ValueCounts counts;
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();

  void add(float value, bool is_active, uint64_t voxels) {
    if (std::isnan(value)) {
      counts.nan += voxels;
    } else if (std::isinf(value)) {
      counts.infinite += voxels;
    } else {
      if (value < 0.0f) counts.negative += voxels;
      if (is_active) {
        min = std::min(min, double(value));
        max = std::max(max, double(value));
      }
    }
    if (!is_active && value != 0.0f) counts.inactive_nonzero += voxels;
  }

  /// The voxels of a leaf that one word of its mask is about.
  void add(const float* values, uint64_t active) {
    constexpr int kVoxels = 64;
    // Where no value is negative or not finite, they compare like the integers that their bits are.
    std::array<int32_t, kVoxels> bits;
    std::memcpy(bits.data(), values, sizeof bits);
    constexpr int32_t kLargest = 0x7f7fffff;  // of the finite floats
    int32_t strange = 0, lowest = kLargest, highest = 0;
    for (const int32_t value : bits) {
      strange |= (value < 0) | (value > kLargest);
      lowest = std::min(lowest, value);
      highest = std::max(highest, value);
    }
    if (strange == 0 && active == 0 && highest == 0) return;
    if (strange == 0 && active == ~uint64_t(0)) {
      min = std::min(min, double(std::bit_cast<float>(lowest)));
      max = std::max(max, double(std::bit_cast<float>(highest)));
      return;
    }
    for (int n = 0; n < kVoxels; ++n) add(values[n], (active >> n & 1) != 0, 1);
  }

  /// The tiles of a node, or of the root.
  template <class Node>
  void add_tiles(const Node& node) {
    for (auto tile = node.cbeginValueAll(); tile; ++tile)
      add(*tile, tile.isValueOn(), Node::ChildNodeType::NUM_VOXELS);
  }

  void add(const Tally& other) {
    counts.nan += other.counts.nan;
    counts.infinite += other.counts.infinite;
    counts.negative += other.counts.negative;
    counts.inactive_nonzero += other.counts.inactive_nonzero;
    min = std::min(min, other.min);
    max = std::max(max, other.max);
  }
};

}  // namespace

ValueCounts count_values(const openvdb::FloatGrid& grid) {
  using LeafNode = openvdb::FloatTree::LeafNodeType;
  constexpr size_t kLeavesPerTask = 256;
  std::vector<const LeafNode*> leaves;
  grid.tree().getNodes(leaves);
  std::vector<Tally> tallies((leaves.size() + kLeavesPerTask - 1) / kLeavesPerTask);
  parallel_for(tallies.size(), [&](size_t task) {
    const size_t end = std::min(leaves.size(), (task + 1) * kLeavesPerTask);
    for (size_t i = task * kLeavesPerTask; i < end; ++i) {
      const LeafNode::NodeMaskType& active = leaves[i]->getValueMask();
      const float* const values = leaves[i]->buffer().data();
      for (openvdb::Index w = 0; w < LeafNode::NodeMaskType::WORD_COUNT; ++w)
        tallies[task].add(values + 64 * w, active.getWord<uint64_t>(w));
    }
  });

  Tally total;
  // Iterators of nodes are several times as fast as those of the tree.
  using Upper = openvdb::FloatTree::RootNodeType::ChildNodeType;
  std::vector<const Upper*> uppers;
  std::vector<const Upper::ChildNodeType*> lowers;
  grid.tree().getNodes(uppers);
  grid.tree().getNodes(lowers);
  total.add_tiles(grid.tree().root());
  for (const auto* node : uppers) total.add_tiles(*node);
  for (const auto* node : lowers) total.add_tiles(*node);
  for (const Tally& tally : tallies) total.add(tally);
  if (total.min <= total.max) {
    total.counts.min = total.min;
    total.counts.max = total.max;
  }
  return total.counts;
}

Vec3d voxel_edges(const Affine& world_from_index) {
  return {world_from_index.direction({1, 0, 0}).length(), world_from_index.direction({0, 1, 0}).length(),
          world_from_index.direction({0, 0, 1}).length()};
}

namespace {

[[noreturn]] void refuse_transform(const std::filesystem::path& path, const openvdb::GridBase& grid,
                                   const char* found) {
  throw Error(
      ErrorKind::file, path.string(),
      fmt::format("grid \"{}\" has a {} transform; expected an invertible one; repair it where it was made",
                  grid.getName(), found));
}

openvdb::Mat4R affine_matrix(const std::filesystem::path& path, const openvdb::GridBase& grid) {
  try {
    return grid.transform().baseMap()->getAffineMap()->getMat4();
  } catch (const openvdb::ArithmeticError&) {  // OpenVDB inverts it on the way
    refuse_transform(path, grid, "singular");
  }
}

}  // namespace

Affine world_from_index(const std::filesystem::path& path, const openvdb::GridBase& grid) {
  PILEUS_CHECK(grid.transform().isLinear());
  const openvdb::Mat4R matrix = affine_matrix(path, grid);
  Imath::M44d row_vector_matrix;
  bool is_finite = true;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      row_vector_matrix[i][j] = matrix[i][j];  // OpenVDB, too, multiplies row vectors from the left
      is_finite = is_finite && std::isfinite(matrix[i][j]);
    }
  }
  const Affine world_from_index(row_vector_matrix);
  // Relative to its own edges, so that tiny voxels are not taken for a singular map.
  const Vec3d edges = voxel_edges(world_from_index);
  const double volume = std::abs(world_from_index.determinant());
  if (!is_finite || !std::isfinite(volume) || !(volume > 1e-12 * edges.x * edges.y * edges.z)) {
    refuse_transform(path, grid, is_finite ? "singular" : "non-finite");
  }
  return world_from_index;
}

}  // namespace pileus
