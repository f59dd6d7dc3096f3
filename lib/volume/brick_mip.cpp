#include "lib/volume/brick_mip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "lib/core/parallel.h"

namespace pileus {
namespace {

constexpr int kLeaf = 8;              ///< nodes along a coarse leaf
constexpr int kFine = 2 * kLeaf + 1;  ///< fine nodes that they are made of

/// Copies a cube of N^3 nodes, z fastest.
template <int N>
void read_nodes(const BrickGrid& grid, const Vec3i& lo, float* nodes) {
  const Vec3i hi = lo + Vec3i(N);
  const auto floor8 = [](int i) { return i & ~7; };
  for (int bx = floor8(lo.x); bx < hi.x; bx += 8) {
    for (int by = floor8(lo.y); by < hi.y; by += 8) {
      for (int bz = floor8(lo.z); bz < hi.z; bz += 8) {
        const BrickGrid::Block* block = grid.block_at({bx, by, bz});
        const BrickGrid::Brick* brick = block ? &grid.brick_at(*block, {bx, by, bz}) : nullptr;
        const float* values = brick && brick->range.hi > 0.0f ? grid.values(*brick) : nullptr;
        const int z0 = std::max(bz, lo.z), z1 = std::min(bz + 8, hi.z);
        for (int x = std::max(bx, lo.x); x < std::min(bx + 8, hi.x); ++x) {
          for (int y = std::max(by, lo.y); y < std::min(by + 8, hi.y); ++y) {
            float* row = nodes + ((x - lo.x) * N + (y - lo.y)) * N + (z0 - lo.z);
            if (values) {
              const float* from =
                  values + (x - bx) * BrickGrid::kStrideX + (y - by) * BrickGrid::kStrideY + (z0 - bz);
              std::copy_n(from, z1 - z0, row);
            } else {
              std::fill_n(row, z1 - z0, 0.0f);
            }
          }
        }
      }
    }
  }
}

float filtered(float before, float at, float after) {
  return 0.25f * (before + after) + 0.5f * at;
}

/// The 8^3 values of the coarse leaf at a coarse node.
void make_leaf(const BrickGrid& fine, const Vec3i& origin, float* leaf) {
  std::array<float, kFine * kFine * kFine> nodes;
  std::array<float, kFine * kFine * kLeaf> along_z;
  std::array<float, kFine * kLeaf * kLeaf> along_yz;
  read_nodes<kFine>(fine, origin * 2 - Vec3i(1), nodes.data());
  for (int row = 0; row < kFine * kFine; ++row) {
    const float* from = nodes.data() + row * kFine;
    for (int z = 0; z < kLeaf; ++z) {
      along_z[size_t(row * kLeaf + z)] = filtered(from[2 * z], from[2 * z + 1], from[2 * z + 2]);
    }
  }
  for (int x = 0; x < kFine; ++x) {
    for (int y = 0; y < kLeaf; ++y) {
      const float* from = along_z.data() + (x * kFine + 2 * y) * kLeaf;
      for (int z = 0; z < kLeaf; ++z) {
        along_yz[size_t((x * kLeaf + y) * kLeaf + z)] =
            filtered(from[z], from[kLeaf + z], from[2 * kLeaf + z]);
      }
    }
  }
  constexpr int kSlice = kLeaf * kLeaf;
  for (int x = 0; x < kLeaf; ++x) {
    const float* from = along_yz.data() + 2 * x * kSlice;
    for (int i = 0; i < kSlice; ++i)
      leaf[x * kSlice + i] = filtered(from[i], from[kSlice + i], from[2 * kSlice + i]);
  }
}

/// Calls visit(place in the block, in bricks; brick) for the bricks [x0, x1) of a block that are not empty.
template <class Visit>
void for_each_brick(const BrickGrid& grid, const BrickGrid::Block& block, int x0, int x1, Visit&& visit) {
  if (block.whole.range.hi == 0.0f) return;
  for (int x = x0; x < x1; ++x) {
    for (int y = 0; y < BrickGrid::kBlockBricks; ++y) {
      for (int z = 0; z < BrickGrid::kBlockBricks; ++z) {
        const Vec3i at(x, y, z);
        const BrickGrid::Brick& brick = grid.brick_at(block, block.origin + at * 8);
        if (brick.range.hi > 0.0f) visit(at, brick);
      }
    }
  }
}

/// Origins of the coarse leaves that may hold something, in a fixed order.
std::vector<Vec3i> wanted_leaves(const BrickGrid& fine) {
  // A block's bricks reach 8 leaves along each axis, and those that end it one more.
  constexpr int kSide = BrickGrid::kBlockBricks / 2 + 1;
  std::vector<std::vector<Vec3i>> of_blocks(fine.blocks().size());
  parallel_for(of_blocks.size(), [&](size_t i) {
    const BrickGrid::Block& block = fine.blocks()[i];
    std::array<bool, kSide * kSide * kSide> is_wanted{};
    for_each_brick(fine, block, 0, BrickGrid::kBlockBricks, [&](const Vec3i& at, const BrickGrid::Brick&) {
      // Brick B holds fine nodes 8B .. 8B + 8, which are seen by coarse nodes 4B .. 4B + 4.
      for (int x = at.x >> 1; x <= (at.x + 1) >> 1; ++x) {
        for (int y = at.y >> 1; y <= (at.y + 1) >> 1; ++y) {
          for (int z = at.z >> 1; z <= (at.z + 1) >> 1; ++z)
            is_wanted[size_t((x * kSide + y) * kSide + z)] = true;
        }
      }
    });
    const Vec3i origin(block.origin.x / 2, block.origin.y / 2, block.origin.z / 2);
    for (int n = 0; n < kSide * kSide * kSide; ++n) {
      if (!is_wanted[size_t(n)]) continue;
      of_blocks[i].push_back(origin + Vec3i(n / (kSide * kSide), n / kSide % kSide, n % kSide) * kLeaf);
    }
  });
  std::vector<Vec3i> leaves;
  for (const std::vector<Vec3i>& some : of_blocks) leaves.insert(leaves.end(), some.begin(), some.end());
  std::sort(leaves.begin(), leaves.end(), [](const Vec3i& a, const Vec3i& b) {
    return std::array{a.x, a.y, a.z} < std::array{b.x, b.y, b.z};
  });
  leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
  return leaves;
}

struct Differences {
  double largest = 0.0, squares = 0.0, nodes = 0.0;

  void add(const Differences& other) {
    largest = std::max(largest, other.largest);
    squares += other.squares;
    nodes += other.nodes;
  }
};

/// At the fine nodes 0 .. 15 along each axis of a coarse brick; its upper faces belong to its neighbours.
Differences differences_in_brick(const BrickGrid& fine, const Vec3i& cell, const float* coarse) {
  constexpr int kNodes = 2 * kLeaf;
  std::array<float, kNodes * kNodes * kNodes> nodes;
  read_nodes<kNodes>(fine, cell * 2, nodes.data());
  Differences found;
  const auto line = [&](int x, int y, int z) {  // along x, of the mean over the corners in y and z
    const float* at = coarse + (x >> 1) * BrickGrid::kStrideX + (y >> 1) * BrickGrid::kStrideY + (z >> 1);
    const int up_y = y & 1 ? BrickGrid::kStrideY : 0, up_z = z & 1;
    return 0.25 * ((double(at[0]) + double(at[up_y])) + (double(at[up_z]) + double(at[up_y + up_z])));
  };
  for (int x = 0; x < kNodes; ++x) {
    for (int y = 0; y < kNodes; ++y) {
      for (int z = 0; z < kNodes; ++z) {
        const double mean = 0.5 * (line(x, y, z) + line(x + (x & 1), y, z));
        const double value = double(nodes[size_t((x * kNodes + y) * kNodes + z)]);
        const double difference = std::abs(value - mean);
        found.largest = std::max(found.largest, difference);
        found.squares += difference * difference;
        found.nodes += value > 0.0 || mean > 0.0 ? 1.0 : 0.0;
      }
    }
  }
  return found;
}

size_t leaves_of_uniform_blocks(const BrickGrid& fine) {
  constexpr size_t kLeavesOfBlock = BrickGrid::kBricksOfBlock / 8;
  return kLeavesOfBlock *
         size_t(std::count_if(fine.blocks().begin(), fine.blocks().end(), [](const BrickGrid::Block& block) {
           return block.table == BrickGrid::Block::kUniform && block.whole.range.hi > 0.0f;
         }));
}

bool is_worth_its_memory(const BrickGrid& fine, double leaves) {
  constexpr double kFewBytes = 16e6, kMostShare = 0.6;
  const double bytes = leaves * BrickGrid::kPitch * sizeof(float);
  return bytes <= std::max(kFewBytes, kMostShare * double(fine.memory_bytes()));
}

}  // namespace

std::optional<BrickGrid> coarsen(const BrickGrid& fine) {
  if (!is_worth_its_memory(fine, double(leaves_of_uniform_blocks(fine)))) return std::nullopt;
  const std::vector<Vec3i> origins = wanted_leaves(fine);
  if (!is_worth_its_memory(fine, double(origins.size()))) return std::nullopt;
  constexpr size_t kValues = kLeaf * kLeaf * kLeaf;
  const LargeArray<float> values = make_large_array<float>(origins.size() * kValues);
  std::vector<VoxelLeaf> leaves(origins.size());
  constexpr size_t kLeavesPerTask = 64;
  parallel_for((leaves.size() + kLeavesPerTask - 1) / kLeavesPerTask, [&](size_t task) {
    const size_t end = std::min(leaves.size(), (task + 1) * kLeavesPerTask);
    for (size_t i = task * kLeavesPerTask; i < end; ++i) {
      leaves[i] = {origins[i], values.get() + i * kValues};
      make_leaf(fine, origins[i], values.get() + i * kValues);
    }
  });
  return build_brick_grid(leaves, {});
}

/// Wherever the fine field is not 0, neither is a corner of the coarse cell there.
LevelDifference compare_levels(const BrickGrid& fine, const BrickGrid& coarse) {
  std::vector<Differences> of_slices(coarse.blocks().size() * BrickGrid::kBlockBricks);
  parallel_for(of_slices.size(), [&](size_t i) {
    const BrickGrid::Block& block = coarse.blocks()[i / BrickGrid::kBlockBricks];
    const int slice = int(i % BrickGrid::kBlockBricks);
    for_each_brick(coarse, block, slice, slice + 1, [&](const Vec3i& at, const BrickGrid::Brick& brick) {
      of_slices[i].add(differences_in_brick(fine, block.origin + at * 8, coarse.values(brick)));
    });
  });
  Differences all;
  for (const Differences& some : of_slices) all.add(some);
  return {all.largest, all.nodes > 0.0 ? all.squares / all.nodes : 0.0};
}

}  // namespace pileus
