#include "lib/volume/brick_grid.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "lib/core/parallel.h"

namespace pileus {
namespace {

constexpr int kBrickShift = 3, kBlockShift = 7;

Vec3i shifted_right(const Vec3i& p, int bits) {
  return {p.x >> bits, p.y >> bits, p.z >> bits};
}

/// Values >= 0 order like their bits, and integers have minima that a compiler turns into vector code.
ValueRange range_of(const float* values, size_t count) {
  int32_t lo = std::numeric_limits<int32_t>::max(), hi = 0;
  for (size_t i = 0; i < count; ++i) {
    int32_t bits;
    std::memcpy(&bits, values + i, sizeof(bits));
    bits &= std::numeric_limits<int32_t>::max();  // -0 is 0
    lo = std::min(lo, bits);
    hi = std::max(hi, bits);
  }
  ValueRange range;
  std::memcpy(&range.lo, &lo, sizeof(lo));
  std::memcpy(&range.hi, &hi, sizeof(hi));
  return range;
}

}  // namespace

const BrickGrid::Block* BrickGrid::block_at(const Vec3i& cell) const {
  const Vec3i block = shifted_right(cell, kBlockShift);
  if (m_block_table.empty()) {
    const auto found = m_block_at.find(block);
    return found == m_block_at.end() ? nullptr : &m_blocks[size_t(found->second)];
  }
  const Vec3i at = block - m_table_lo;
  const bool is_inside = at.x >= 0 && at.x < m_table_size.x && at.y >= 0 && at.y < m_table_size.y &&
                         at.z >= 0 && at.z < m_table_size.z;
  if (!is_inside) return nullptr;
  const int32_t index =
      m_block_table[(size_t(at.x) * size_t(m_table_size.y) + size_t(at.y)) * size_t(m_table_size.z) +
                    size_t(at.z)];
  return index < 0 ? nullptr : &m_blocks[size_t(index)];
}

size_t BrickGrid::memory_bytes() const {
  return size_t(m_slots) * kPitch * sizeof(float) + m_bricks.size() * sizeof(Brick) +
         m_blocks.size() * sizeof(Block) + m_block_table.size() * sizeof(int32_t);
}

float BrickGrid::max_value() const {
  float largest = 0.0f;
  for (const Block& block : m_blocks) largest = std::max(largest, block.whole.range.hi);
  return largest;
}

/// Works in units of blocks: each knows which of its bricks may hold something and where their voxels come
/// from.
class BrickGridBuilder {
 public:
  BrickGridBuilder(std::span<const VoxelLeaf> leaves, std::span<const VoxelTile> tiles)
      : m_leaves(leaves), m_tiles(tiles) {}

  BrickGrid build() {
    for (const VoxelTile& tile : m_tiles) place_tile(tile);
    place_leaves();
    m_grid.m_lo = m_bounds.lo();
    m_grid.m_hi = m_bounds.hi();
    sort_blocks();
    make_block_table();
    number_bricks();
    fill_bricks();
    return std::move(m_grid);
  }

 private:
  static constexpr size_t kBricks = BrickGrid::kBricksOfBlock;
  static constexpr int32_t kNothing = -1;  ///< source: 0 everywhere; tile n is the source -2 - n, leaf n is n

  struct WorkBlock {
    Vec3i block{0, 0, 0};        ///< in blocks
    int32_t uniform = kNothing;  ///< the tile that fills the block and its upper neighbours
    std::vector<int32_t> sources;
    std::vector<char> is_wanted;  ///< may hold a cell that is not 0

    void make_tables() {
      if (!sources.empty()) return;
      sources.assign(kBricks, kNothing);
      is_wanted.assign(kBricks, 0);
    }
  };

  /// The block, made where it is missing.
  WorkBlock& work_block(const Vec3i& block) {
    if (m_blocks.empty() || block != m_blocks[m_last].block) {
      const auto [found, is_new] = m_index.try_emplace(block, m_blocks.size());
      if (is_new) m_blocks.emplace_back().block = block;
      m_last = found->second;
    }
    return m_blocks[m_last];
  }

  void want(const Vec3i& brick) {
    WorkBlock& block = work_block(shifted_right(brick, kBlockShift - kBrickShift));
    if (block.uniform != kNothing) return;
    block.make_tables();
    block.is_wanted[BrickGrid::brick_index(brick * 8)] = 1;
  }

  void place_source(const Vec3i& brick, int32_t source) {
    WorkBlock& block = work_block(shifted_right(brick, kBlockShift - kBrickShift));
    block.make_tables();
    block.sources[BrickGrid::brick_index(brick * 8)] = source;
  }

  void place_leaves() {
    std::vector<uint8_t> reached(m_leaves.size());
    constexpr size_t kLeavesPerTask = 256;
    parallel_for((m_leaves.size() + kLeavesPerTask - 1) / kLeavesPerTask, [&](size_t task) {
      const size_t end = std::min(m_leaves.size(), (task + 1) * kLeavesPerTask);
      for (size_t i = task * kLeavesPerTask; i < end; ++i) reached[i] = reached_bricks(m_leaves[i].values);
    });
    for (size_t i = 0; i < m_leaves.size(); ++i) {
      if (reached[i] == 0) continue;
      m_bounds.extend(m_leaves[i].origin, 8);
      const Vec3i brick = shifted_right(m_leaves[i].origin, kBrickShift);
      place_source(brick, int32_t(i));
      for (int n = 0; n < 8; ++n) {
        if (reached[i] >> n & 1) want(brick - Vec3i(n & 1, n >> 1 & 1, n >> 2));
      }
    }
  }

  /// Bit dx + 2 dy + 4 dz: the leaf's non-zero voxels are corners of cells in the brick at -(dx, dy, dz).
  static uint8_t reached_bricks(const float* values) {
    const auto any = [&](int x1, int y1, int z1) {
      float sum = 0.0f;
      for (int x = 0; x < x1; ++x) {
        for (int y = 0; y < y1; ++y) {
          for (int z = 0; z < z1; ++z) sum += values[x << 6 | y << 3 | z];
        }
      }
      return sum > 0.0f;
    };
    uint8_t reached = 0;
    for (int n = 0; n < 8; ++n) {
      if (any(n & 1 ? 1 : 8, n & 2 ? 1 : 8, n & 4 ? 1 : 8)) reached |= uint8_t(1 << n);
      if (reached == 0) break;  // all of the leaf is 0
    }
    return reached;
  }

  /// A tile fills its bricks; those at its upper faces and beyond its lower faces hold other values too.
  /// Blocks deep inside get no tables.
  void place_tile(const VoxelTile& tile) {
    if (!(tile.value > 0.0f)) return;
    const int32_t source = int32_t(-2 - (&tile - m_tiles.data()));
    check_memory_for_faces(tile);
    m_bounds.extend(tile.origin, tile.size);
    const Vec3i first = shifted_right(tile.origin, kBrickShift);
    const int bricks = tile.size / 8, blocks = std::max(1, tile.size / BrickGrid::kBlockCells);
    const Vec3i first_block = shifted_right(tile.origin, kBlockShift);
    for_each_in_cube(blocks, [&](const Vec3i& at) {
      const bool is_inside = at.x < blocks - 1 && at.y < blocks - 1 && at.z < blocks - 1;
      WorkBlock& block = work_block(first_block + at);
      if (is_inside) {
        block.uniform = source;
      } else {
        block.make_tables();
      }
    });
    const int stretch = std::min(bricks, BrickGrid::kBlockBricks);
    for_each_in_cube(blocks, [&](const Vec3i& at) {
      if (work_block(first_block + at).uniform != kNothing) return;
      for_each_in_cube(stretch, [&](const Vec3i& inner) {
        place_source(first + at * BrickGrid::kBlockBricks + inner, source);
        want(first + at * BrickGrid::kBlockBricks + inner);
      });
    });
    // The layer of bricks below each lower face.
    for (int a = -1; a < bricks; ++a) {
      for (int b = -1; b < bricks; ++b) {
        want(first + Vec3i(-1, a, b));
        want(first + Vec3i(a, -1, b));
        want(first + Vec3i(a, b, -1));
      }
    }
  }

  template <class Visit>
  static void for_each_in_cube(int n, Visit&& visit) {
    for (int x = 0; x < n; ++x) {
      for (int y = 0; y < n; ++y) {
        for (int z = 0; z < n; ++z) visit(Vec3i(x, y, z));
      }
    }
  }

  void check_memory_for_faces(const VoxelTile& tile) {
    m_face_bricks += 6.0 * (tile.size / 8.0 + 1.0) * (tile.size / 8.0 + 1.0);
    check_memory(m_face_bricks);
  }

  static void check_memory(double bricks) {
    const double needed = bricks * BrickGrid::kPitch * sizeof(float);
    if (needed <= double(memory_budget())) return;
    throw Error(ErrorKind::failed, SourceLoc{},
                fmt::format("its bricks need {}, the memory budget is {} (--memory); clip the grid to its "
                            "visible part",
                            bytes_text(uint64_t(std::min(needed, 1e19))), bytes_text(memory_budget())));
  }

  /// The order of blocks, and with it of all that follows, comes from their places alone.
  void sort_blocks() {
    std::sort(m_blocks.begin(), m_blocks.end(), [](const WorkBlock& a, const WorkBlock& b) {
      return std::array{a.block.x, a.block.y, a.block.z} < std::array{b.block.x, b.block.y, b.block.z};
    });
    for (size_t i = 0; i < m_blocks.size(); ++i) m_index[m_blocks[i].block] = i;
  }

  void make_block_table() {
    m_grid.m_blocks.resize(m_blocks.size());
    if (m_blocks.empty()) return;
    Vec3i lo = m_blocks.front().block, hi = lo;
    for (const WorkBlock& block : m_blocks) {
      for (int axis = 0; axis < 3; ++axis) {
        lo[axis] = std::min(lo[axis], block.block[axis]);
        hi[axis] = std::max(hi[axis], block.block[axis]);
      }
    }
    constexpr double kMostPlaces = 1 << 21;
    const Vec3d size = Vec3d(hi) - Vec3d(lo) + Vec3d(1.0);
    const bool has_table = size.x * size.y * size.z <= kMostPlaces;
    if (has_table) {
      m_grid.m_table_lo = lo;
      m_grid.m_table_size = hi - lo + Vec3i(1);
      m_grid.m_block_table.assign(size_t(size.x * size.y * size.z), -1);
    }
    for (size_t i = 0; i < m_blocks.size(); ++i) {
      m_grid.m_blocks[i].origin = m_blocks[i].block * BrickGrid::kBlockCells;
      if (!has_table) {
        m_grid.m_block_at[m_blocks[i].block] = int32_t(i);
        continue;
      }
      const Vec3i at = m_blocks[i].block - lo, n = m_grid.m_table_size;
      m_grid.m_block_table[(size_t(at.x) * size_t(n.y) + size_t(at.y)) * size_t(n.z) + size_t(at.z)] =
          int32_t(i);
    }
  }

  /// The sources of a brick's corner values: of the brick itself and of its upper neighbours.
  ///   sources[dx + 2 dy + 4 dz]
  std::array<int32_t, 8> sources_of(const Vec3i& brick) const {
    std::array<int32_t, 8> sources;
    const WorkBlock* block = nullptr;
    Vec3i place(0);
    for (int n = 0; n < 8; ++n) {
      const Vec3i at = brick + Vec3i(n & 1, n >> 1 & 1, n >> 2);
      const Vec3i place_here = shifted_right(at, kBlockShift - kBrickShift);
      if (n == 0 || place_here != place) {
        const auto found = m_index.find(place_here);
        block = found == m_index.end() ? nullptr : &m_blocks[found->second];
        place = place_here;
      }
      sources[size_t(n)] = !block                   ? kNothing
                           : block->sources.empty() ? block->uniform
                                                    : block->sources[BrickGrid::brick_index(at * 8)];
    }
    return sources;
  }

  float uniform_value(int32_t source) const {
    return source == kNothing ? 0.0f : m_tiles[size_t(-2 - source)].value;
  }

  /// True where all sources are one constant.
  bool is_uniform(const std::array<int32_t, 8>& sources) const {
    const auto is_leaf = [](int32_t source) { return source >= 0; };
    if (std::any_of(sources.begin(), sources.end(), is_leaf)) return false;
    return std::all_of(sources.begin(), sources.end(),
                       [&](int32_t source) { return uniform_value(source) == uniform_value(sources[0]); });
  }

  /// Gives every wanted brick its place: which have values, and where.
  void number_bricks() {
    int32_t tables = 0;
    for (size_t i = 0; i < m_blocks.size(); ++i) {
      BrickGrid::Block& block = m_grid.m_blocks[i];
      if (m_blocks[i].sources.empty()) {
        block.whole = uniform_brick(uniform_value(m_blocks[i].uniform));
      } else {
        block.table = tables++;
      }
    }
    m_grid.m_bricks.resize(size_t(tables) * kBricks);
    std::vector<int64_t> wanted(m_blocks.size() + 1, 0);
    for (size_t i = 0; i < m_blocks.size(); ++i) {
      wanted[i + 1] =
          wanted[i] + std::count(m_blocks[i].is_wanted.begin(), m_blocks[i].is_wanted.end(), char(1));
    }
    m_wanted.resize(size_t(wanted.back()));
    parallel_for(m_blocks.size(), [&](size_t i) {
      size_t next = size_t(wanted[i]);
      for (size_t n = 0; n < m_blocks[i].is_wanted.size(); ++n) {
        if (m_blocks[i].is_wanted[n]) m_wanted[next++] = {uint32_t(i), uint32_t(n)};
      }
    });
  }

  struct WantedBrick {
    uint32_t block, brick;  ///< indices into m_blocks and into the block's table
  };

  static Vec3i brick_of(const WorkBlock& block, uint32_t index) {
    return block.block * BrickGrid::kBlockBricks +
           Vec3i(int(index >> 8), int(index >> 4 & 15), int(index & 15));
  }

  void fill_bricks() {
    constexpr size_t kBricksPerTask = 128;
    const size_t tasks = (m_wanted.size() + kBricksPerTask - 1) / kBricksPerTask;
    const auto for_bricks_of = [&](size_t task, auto&& visit) {
      const size_t end = std::min(m_wanted.size(), (task + 1) * kBricksPerTask);
      for (size_t n = task * kBricksPerTask; n < end; ++n) {
        const auto [block, index] = m_wanted[n];
        visit(brick_of(m_blocks[block], index),
              m_grid.m_bricks[size_t(m_grid.m_blocks[block].table) * kBricks + index]);
      }
    };
    std::vector<int32_t> slots(tasks + 1, 0);
    parallel_for(tasks, [&](size_t task) {
      for_bricks_of(task, [&](const Vec3i& at, BrickGrid::Brick& brick) {
        const auto sources = sources_of(at);
        if (is_uniform(sources)) {
          brick.range.lo = brick.range.hi = uniform_value(sources[0]);
        } else {
          brick.slot = ++slots[task + 1];
        }
      });
    });
    share_uniform_bricks();
    slots[0] = int32_t(m_slot_of_uniform.size()) - 1;
    for (size_t task = 0; task < tasks; ++task) slots[task + 1] += slots[task];
    m_grid.m_slots = slots[tasks] + 1;
    check_memory(double(m_grid.m_slots));
    m_grid.m_values = make_large_array<float>(size_t(m_grid.m_slots) * BrickGrid::kPitch);
    for (const auto& [value, slot] : m_slot_of_uniform) {
      std::fill_n(m_grid.m_values.get() + size_t(slot) * BrickGrid::kPitch, BrickGrid::kPitch, value);
    }
    parallel_for(tasks, [&](size_t task) {
      for_bricks_of(task, [&](const Vec3i& at, BrickGrid::Brick& brick) {
        if (brick.range.hi > 0.0f || brick.slot == 0) return;  // uniform
        brick.slot += slots[task];
        float* values = m_grid.m_values.get() + size_t(brick.slot) * BrickGrid::kPitch;
        fill(sources_of(at), values);
        brick.range = range_of(values, BrickGrid::kValues);
      });
    });
    collect_block_ranges();
  }

  /// The brick that stands for all of one value; slot 0 is that of 0.
  BrickGrid::Brick uniform_brick(float value) {
    const auto [found, is_new] = m_slot_of_uniform.try_emplace(value, int32_t(m_slot_of_uniform.size()));
    return {found->second, {value, value}};
  }

  void share_uniform_bricks() {
    for (BrickGrid::Brick& brick : m_grid.m_bricks) {
      if (brick.slot == 0 && brick.range.hi > 0.0f) brick = uniform_brick(brick.range.hi);
    }
  }

  /// Copies the 9^3 corner values of a brick, row by row along z.
  void fill(const std::array<int32_t, 8>& sources, float* values) const {
    for (int x = 0; x < 9; ++x) {
      for (int y = 0; y < 9; ++y) {
        const size_t n = size_t((x >> 3) + 2 * (y >> 3));
        const int offset = (x & 7) << 6 | (y & 7) << 3;
        float* row = values + x * BrickGrid::kStrideX + y * BrickGrid::kStrideY;
        if (const int32_t source = sources[n]; source >= 0) {
          std::memcpy(row, m_leaves[size_t(source)].values + offset, 8 * sizeof(float));
        } else {
          std::fill_n(row, 8, uniform_value(source));
        }
        const int32_t last = sources[n + 4];
        row[8] = last >= 0 ? m_leaves[size_t(last)].values[offset] : uniform_value(last);
      }
    }
    std::fill(values + BrickGrid::kValues, values + BrickGrid::kPitch, 0.0f);
  }

  void collect_block_ranges() {
    parallel_for(m_blocks.size(), [&](size_t i) {
      BrickGrid::Block& block = m_grid.m_blocks[i];
      if (block.table == BrickGrid::Block::kUniform) return;
      const BrickGrid::Brick* bricks = m_grid.m_bricks.data() + size_t(block.table) * kBricks;
      block.whole.range = bricks[0].range;
      for (size_t n = 1; n < kBricks; ++n) block.whole.range.include(bricks[n].range);
    });
  }

  std::span<const VoxelLeaf> m_leaves;
  std::span<const VoxelTile> m_tiles;
  std::vector<WorkBlock> m_blocks;
  BlockMap<size_t> m_index;  ///< into m_blocks
  size_t m_last = 0;
  std::vector<WantedBrick> m_wanted;
  double m_face_bricks = 0.0;
  CellBounds m_bounds;
  std::map<float, int32_t> m_slot_of_uniform{{0.0f, 0}};
  BrickGrid m_grid;
};

VoxelSource voxels_of(const BrickGrid& grid) {
  constexpr size_t kLeafVoxels = 512;
  constexpr int kSide = BrickGrid::kBrickCells;
  std::vector<VoxelTile> tiles;
  struct Place {
    Vec3i origin;
    const float* values;
  };
  std::vector<Place> places;
  for (const BrickGrid::Block& block : grid.blocks()) {
    if (block.table == BrickGrid::Block::kUniform) {
      if (block.whole.range.hi > 0.0f)
        tiles.push_back({block.origin, BrickGrid::kBlockCells, block.whole.range.hi});
      continue;
    }
    for (int n = 0; n < int(BrickGrid::kBricksOfBlock); ++n) {
      const Vec3i origin = block.origin + kSide * Vec3i(n >> 8, n >> 4 & 15, n & 15);
      const BrickGrid::Brick& brick = grid.brick_at(block, origin);
      if (brick.range.is_uniform()) {
        if (brick.range.hi > 0.0f) tiles.push_back({origin, kSide, brick.range.hi});
      } else {
        places.push_back({origin, grid.values(brick)});
      }
    }
  }
  auto values = std::make_shared<LargeArray<float>>(make_large_array<float>(places.size() * kLeafVoxels));
  std::vector<VoxelLeaf> leaves(places.size());
  parallel_for(places.size(), [&](size_t i) {
    float* to = values->get() + i * kLeafVoxels;
    leaves[i] = {places[i].origin, to};
    for (int x = 0; x < kSide; ++x) {
      for (int y = 0; y < kSide; ++y, to += kSide)
        std::copy_n(places[i].values + x * BrickGrid::kStrideX + y * BrickGrid::kStrideY, kSide, to);
    }
  });
  return {std::move(leaves), std::move(tiles), std::move(values)};
}

BrickGrid build_brick_grid(std::span<const VoxelLeaf> leaves, std::span<const VoxelTile> tiles) {
  return BrickGridBuilder(leaves, tiles).build();
}

}  // namespace pileus
