#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "lib/volume/brick_grid.h"

namespace pileus {

struct QuantizedValues;

/// What SIMD lanes and leaping rays need of a brick grid: a flat table that says where the values of a brick
/// are, and the ranges of ever larger nodes. Level 0 are the bricks of 8^3 cells, each level doubles the
/// edge. Around the grid lies at least one brick of zeros, so that a point that rounding has put outside
/// reads 0. Values are the floats of a BrickGrid, or 16-bit ones (quantized_bricks.h); ranges are of the
/// values that stand there.
class BrickPyramid {
 public:
  struct Level {
    Vec3i nodes{0, 0, 0};            ///< number of nodes
    std::vector<ValueRange> ranges;  ///< [x][y][z], z fastest
  };

  /// errors: Error(failed) where the grid's box has more than kMostBricks bricks, or its values more than
  /// 2^31
  explicit BrickPyramid(const BrickGrid& grid);

  static constexpr double kMostBricks = double(1 << 26);

  /// The 16-bit values; null where the values are those of grid().
  const QuantizedValues* quantized() const { return m_quantized.get(); }

  /// Only where there are no 16-bit values.
  const BrickGrid& grid() const;

  /// All cells that may be non-zero, [lo, hi); lo = hi where there are none.
  const Vec3i& lo() const { return m_lo; }
  const Vec3i& hi() const { return m_hi; }

  size_t bytes_of_values() const;

  /// The first cell of the table; a position relative to it is >= 0 wherever there is a table entry.
  const Vec3i& origin() const { return m_origin; }

  /// Where the values of a brick are: index into all of them, [x][y][z] of the brick, z fastest.
  const std::vector<int32_t>& offsets() const { return m_offsets; }

  const std::vector<Level>& levels() const { return m_levels; }

  /// Range of the node of a level that holds a cell, which is relative to origin() and in the table.
  const ValueRange& range(size_t level, const Vec3i& cell) const {
    const Level& nodes = m_levels[level];
    const int shift = 3 + int(level);
    return nodes.ranges[(size_t(cell.x >> shift) * size_t(nodes.nodes.y) + size_t(cell.y >> shift)) *
                            size_t(nodes.nodes.z) +
                        size_t(cell.z >> shift)];
  }

  /// Range of the values that a point in a box can read, from nodes about as large as the box.
  ///   box: relative to origin(); what lies outside the table reads its edge, which is 0
  ValueRange range(const Box3d& box) const;

 private:
  friend class QuantizedBuilder;

  BrickPyramid() = default;
  void make_table(const Vec3i& lo, const Vec3i& hi);
  void check_value_count(double values) const;
  void fill_level_0();
  void add_levels();
  void add_level();

  const BrickGrid* m_grid = nullptr;
  std::shared_ptr<const QuantizedValues> m_quantized;
  Vec3i m_lo{0, 0, 0}, m_hi{0, 0, 0};
  Vec3i m_origin{0, 0, 0};
  std::vector<int32_t> m_offsets;
  std::vector<Level> m_levels;
};

inline ValueRange BrickPyramid::range(const Box3d& box) const {
  constexpr double kNodesAcross = 2.0;
  double extent = 0.0;
  for (int axis = 0; axis < 3; ++axis) extent = std::max(extent, box.max[axis] - box.min[axis]);
  size_t level = 0;
  while (level + 1 < m_levels.size() && extent > kNodesAcross * double(8 << level)) ++level;

  const Level& nodes = m_levels[level];
  const int shift = 3 + int(level);
  int lo[3], hi[3];
  for (int axis = 0; axis < 3; ++axis) {
    // NaN becomes 0.
    const double most = double(nodes.nodes[axis] << shift) - 1.0;
    lo[axis] = int(std::max(0.0, std::min(box.min[axis], most))) >> shift;
    hi[axis] = int(std::max(0.0, std::min(box.max[axis], most))) >> shift;
  }
  ValueRange range{std::numeric_limits<float>::max(), 0.0f};
  for (int x = lo[0]; x <= hi[0]; ++x) {
    for (int y = lo[1]; y <= hi[1]; ++y) {
      const ValueRange* row =
          nodes.ranges.data() + (size_t(x) * size_t(nodes.nodes.y) + size_t(y)) * size_t(nodes.nodes.z);
      for (int z = lo[2]; z <= hi[2]; ++z) range.include(row[z]);
    }
  }
  return range;
}

}  // namespace pileus
