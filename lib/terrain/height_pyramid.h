#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lib/core/large_array.h"
#include "lib/terrain/height_range.h"
#include "lib/terrain/height_table.h"

namespace pileus {

/// Bounds of the interpolated surface over blocks of 2^level x 2^level cells, for levels from 1 up to one
/// block for all: of all nodes that a cell touches, the shared rows and columns included. A cell with a
/// corner without data has no surface. ref: METHODS 6.3
///
/// On demand each block also knows by how much the surface deviates, vertically, from the bilinear patch
/// between the block's corners: infinitely where a part of it has no data.
class HeightPyramid {
 public:
  /// Up to this level blocks are seen as patches between their corners.
  static constexpr int kCoarsestPatch = 5;

  HeightPyramid() = default;

  /// Built on all cores; the ranges do not depend on how many.
  explicit HeightPyramid(const HeightTable& table,
                         HeightInterpolation interpolation = HeightInterpolation::bilinear,
                         bool with_deviations = false);

  int top() const { return int(m_levels.size()); }
  const HeightRange& at(int level, int i, int j) const {
    const Level& blocks = m_levels[size_t(level - 1)];
    return blocks.ranges[size_t(j) * size_t(blocks.width) + size_t(i)];
  }
  float deviation(int level, int i, int j) const {
    const Level& blocks = m_levels[size_t(level - 1)];
    return m_deviation_steps[blocks.deviations[size_t(j) * size_t(blocks.width) + size_t(i)]];
  }

  /// HeightTable::patch of a level up to kCoarsestPatch, where deviations were asked for. From a table of its
  /// own for each level: corners of neighbouring blocks lie side by side.
  Patch<double> patch(int level, int i, int j) const {
    return m_levels[size_t(level - 1)].corners.patch(i, j);
  }

  int width(int level) const { return m_levels[size_t(level - 1)].width; }
  int height(int level) const { return m_levels[size_t(level - 1)].height; }
  const HeightRange& all() const { return at(top(), 0, 0); }

  /// Bounds of the surface between two map points, which are clamped to the map: of at most 3 x 3 blocks of a
  /// level of at least `least_level`, where there is one.
  HeightRange between(double u0, double v0, double u1, double v1, int least_level = 1) const;

 private:
  struct Level {
    int width = 0, height = 0;
    LargeArray<HeightRange> ranges;
    LargeArray<uint8_t> deviations;  ///< numbers of steps; null where nobody asked for them
    HeightTable corners;             ///< empty where nobody asked for them, or too coarse
  };

  void add_level(int width, int height);
  void merge_rows(int level, int first, int end);
  void add_deviations(const HeightTable& table, HeightInterpolation interpolation, int level);
  float deviation_inside(const HeightTable& table, HeightInterpolation interpolation, int level, int i,
                         int j) const;

  void add_corners(const HeightTable& table, int level);

  std::vector<Level> m_levels;
  std::array<float, 256> m_deviation_steps{};  ///< 0, then quarters of octaves, infinity
};

}  // namespace pileus
