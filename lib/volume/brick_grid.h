#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "lib/core/large_array.h"
#include "lib/math/vec.h"
#include "lib/volume/voxel_source.h"

namespace pileus {

/// Smallest and largest value over an interpolation footprint: of all corner values of the cells meant.
/// A trilinear function takes its extremes at corners, so nothing in those cells lies outside.
struct ValueRange {
  float lo = 0.0f, hi = 0.0f;

  bool is_uniform() const { return lo == hi; }
  void include(const ValueRange& other) {
    lo = other.lo < lo ? other.lo : lo;
    hi = other.hi > hi ? other.hi : hi;
  }
};

/// Something for each of a few blocks, found by where they are.
struct BlockHash {
  size_t operator()(const Vec3i& block) const {
    const auto bits = [](int i) { return uint64_t(uint32_t(i)); };
    const uint64_t mixed = bits(block.x) * 0x9e3779b97f4a7c15u ^ bits(block.y) * 0xc2b2ae3d27d4eb4fu ^
                           bits(block.z) * 0x165667b19e3779f9u;
    return size_t(mixed ^ mixed >> 32);
  }
};
template <class T>
using BlockMap = std::unordered_map<Vec3i, T, BlockHash>;

/// A sparse grid of values >= 0 in bricks laid out for marching; outside, the value is 0.
///
/// Voxel values sit at integer index positions; cell (i, j, k) is the cube [i, i+1] x [j, j+1] x [k, k+1]. A
/// brick covers 8^3 cells and stores the 9^3 values at their corners: every cell finds its corners in one
/// brick, at fixed distances, for 1.42 times the memory of the voxels (METHODS §9.5 asks for the extra layer
/// in any case). Three levels, each with exact ranges over interpolation footprints: blocks of 128^3 cells,
/// bricks of 8^3 cells, cells. Bricks inside tiles of one value share one copy of it; slot 0 holds zeros.
class BrickGrid {
 public:
  static constexpr int kBrickCells = 8;
  static constexpr int kBlockBricks = 16;
  static constexpr int kBlockCells = kBlockBricks * kBrickCells;
  static constexpr int kStrideX = 81, kStrideY = 9, kStrideZ = 1;  ///< between neighbours in a brick's values
  static constexpr int kValues = 729;                              ///< of one brick
  static constexpr int kPitch = 736;  ///< from one brick's values to the next's: whole cache lines

  struct Brick {
    int32_t slot = 0;  ///< values are at slot * kPitch
    ValueRange range;
  };

  struct Block {
    static constexpr int32_t kUniform = -1;
    Vec3i origin{0, 0, 0};     ///< its first cell, a multiple of kBlockCells
    int32_t table = kUniform;  ///< its 16^3 bricks are at table * 4096, z fastest
    Brick whole;  ///< stands for every brick of a uniform block; its range is the block's in any case
  };

  /// The block that holds a cell; null where there is nothing.
  const Block* block_at(const Vec3i& cell) const;

  /// The brick that holds a cell of a block.
  const Brick& brick_at(const Block& block, const Vec3i& cell) const {
    if (block.table == Block::kUniform) return block.whole;
    return m_bricks[size_t(block.table) * kBricksOfBlock + brick_index(cell)];
  }

  /// The 9^3 corner values of a brick, at strides kStrideX, Y, Z.
  const float* values(const Brick& brick) const { return m_values.get() + size_t(brick.slot) * kPitch; }

  /// All cells that may be non-zero, [lo, hi); lo = hi where there are none.
  const Vec3i& lo() const { return m_lo; }
  const Vec3i& hi() const { return m_hi; }

  const std::vector<Block>& blocks() const { return m_blocks; }
  std::span<const float> all_values() const { return {m_values.get(), size_t(m_slots) * kPitch}; }
  size_t memory_bytes() const;
  float max_value() const;

  /// Index of a cell's brick in its block's table.
  static size_t brick_index(const Vec3i& cell) {
    return size_t((cell.x >> 3 & 15) << 8 | (cell.y >> 3 & 15) << 4 | (cell.z >> 3 & 15));
  }
  static constexpr size_t kBricksOfBlock = size_t(kBlockBricks) * kBlockBricks * kBlockBricks;

 private:
  friend class BrickGridBuilder;

  std::vector<Block> m_blocks;
  BlockMap<int32_t> m_block_at;                      ///< where the box of blocks is too large for a table
  std::vector<int32_t> m_block_table;                ///< block at a place in the box of blocks, or -1
  Vec3i m_table_lo{0, 0, 0}, m_table_size{0, 0, 0};  ///< the box of blocks, in blocks
  std::vector<Brick> m_bricks;
  LargeArray<float> m_values;
  int64_t m_slots = 0;
  Vec3i m_lo{0, 0, 0}, m_hi{0, 0, 0};
};

/// Builds the grid from leaves and tiles that do not overlap; their values are finite and >= 0. Uses
/// parallel_for; the result does not depend on threads or on the order of the sources.
/// errors: Error(failed) where the bricks need more memory than the budget (lib/core/memory_budget.h), or where
/// voxels lie within 2^13 of the ends of the integers
BrickGrid build_brick_grid(std::span<const VoxelLeaf> leaves, std::span<const VoxelTile> tiles);

/// The voxels that a grid was built of, copied: a leaf for each brick that has values of its own, and tiles.
VoxelSource voxels_of(const BrickGrid& grid);

}  // namespace pileus
