#include "lib/volume/brick_pyramid.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/volume/quantized_bricks.h"

namespace pileus {
namespace {

[[noreturn]] void throw_too_large(const Vec3d& cells) {
  throw Error(
      ErrorKind::failed, SourceLoc{},
      fmt::format("the volume spans {:.0f} x {:.0f} x {:.0f} voxels; expected at most {:.2g} in the box; "
                  "clip it, or use integrator \"exact\"",
                  cells.x, cells.y, cells.z, 512 * BrickPyramid::kMostBricks));
}

}  // namespace

BrickPyramid::BrickPyramid(const BrickGrid& grid) : m_grid(&grid) {
  make_table(grid.lo(), grid.hi());
  check_value_count(double(grid.all_values().size()));
  fill_level_0();
  add_levels();
}

const BrickGrid& BrickPyramid::grid() const {
  PILEUS_CHECK(m_grid != nullptr);
  return *m_grid;
}

size_t BrickPyramid::bytes_of_values() const {
  return m_quantized ? m_quantized->count * sizeof(int16_t) : grid().all_values().size_bytes();
}

void BrickPyramid::make_table(const Vec3i& lo, const Vec3i& hi) {
  constexpr int kAlign = 64;  // cells: the first levels then have whole nodes
  m_lo = lo;
  m_hi = hi;
  Vec3d bricks(0.0);
  Level bottom;
  for (int axis = 0; axis < 3; ++axis) {
    m_origin[axis] = ((lo[axis] - 8) & ~(kAlign - 1));
    bricks[axis] = std::floor((double(hi[axis]) - m_origin[axis]) / 8.0) + 2.0;
    bottom.nodes[axis] = int(bricks[axis]);
  }
  constexpr int kFarthest = 1 << 30;  // leaves room for sums of indices
  const bool is_far = std::min({lo.x, lo.y, lo.z}) < -kFarthest || std::max({hi.x, hi.y, hi.z}) > kFarthest;
  if (is_far || bricks.x * bricks.y * bricks.z > kMostBricks) throw_too_large(8.0 * bricks);
  m_offsets.assign(size_t(bricks.x * bricks.y * bricks.z), 0);
  bottom.ranges.resize(m_offsets.size());
  m_levels.push_back(std::move(bottom));
}

void BrickPyramid::check_value_count(double values) const {
  constexpr double kMost = 2147483647.0;  // offsets have 32 bits
  if (values > kMost) throw_too_large(Vec3d(m_hi - m_lo));
}

void BrickPyramid::fill_level_0() {
  Level& level = m_levels.front();
  const Vec3i n = level.nodes;
  parallel_for(size_t(n.x), [&](size_t x) {
    for (int y = 0; y < n.y; ++y) {
      const BrickGrid::Block* block = nullptr;
      for (int z = 0; z < n.z; ++z) {
        const Vec3i cell = m_origin + Vec3i(int(x), y, z) * 8;
        if (z == 0 || (cell.z & (BrickGrid::kBlockCells - 1)) == 0) block = m_grid->block_at(cell);
        if (!block) continue;
        const BrickGrid::Brick& brick = m_grid->brick_at(*block, cell);
        const size_t at = (x * size_t(n.y) + size_t(y)) * size_t(n.z) + size_t(z);
        m_offsets[at] = brick.slot * BrickGrid::kPitch;
        level.ranges[at] = brick.range;
      }
    }
  });
}

void BrickPyramid::add_levels() {
  while (std::max({m_levels.back().nodes.x, m_levels.back().nodes.y, m_levels.back().nodes.z}) > 1)
    add_level();
}

void BrickPyramid::add_level() {
  const Level& finer = m_levels.back();
  Level coarser;
  for (int axis = 0; axis < 3; ++axis) coarser.nodes[axis] = (finer.nodes[axis] + 1) / 2;
  const Vec3i n = coarser.nodes, m = finer.nodes;
  coarser.ranges.resize(size_t(n.x) * size_t(n.y) * size_t(n.z));
  parallel_for(size_t(n.x), [&](size_t x) {
    for (int y = 0; y < n.y; ++y) {
      for (int z = 0; z < n.z; ++z) {
        const auto child = [&](int i) -> const ValueRange& {
          const int cx = std::min(2 * int(x) + (i & 1), m.x - 1),
                    cy = std::min(2 * y + (i >> 1 & 1), m.y - 1), cz = std::min(2 * z + (i >> 2), m.z - 1);
          return finer.ranges[(size_t(cx) * size_t(m.y) + size_t(cy)) * size_t(m.z) + size_t(cz)];
        };
        ValueRange range = child(0);
        for (int i = 1; i < 8; ++i) range.include(child(i));
        coarser.ranges[(x * size_t(n.y) + size_t(y)) * size_t(n.z) + size_t(z)] = range;
      }
    }
  });
  m_levels.push_back(std::move(coarser));
}

}  // namespace pileus
