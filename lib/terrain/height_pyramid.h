#pragma once

#include <vector>

#include "lib/core/large_array.h"
#include "lib/terrain/height_range.h"
#include "lib/terrain/height_table.h"

namespace pileus {

/// Bounds of the interpolated surface over blocks of 2^level x 2^level cells, for levels from 1 up to one
/// block for all: of all nodes that a cell touches, the shared rows and columns included. A cell with a
/// corner without data has no surface. ref: METHODS 6.3
class HeightPyramid {
 public:
  HeightPyramid() = default;

  /// Built on all cores; the ranges do not depend on how many.
  explicit HeightPyramid(const HeightTable& table,
                         HeightInterpolation interpolation = HeightInterpolation::bilinear);

  int top() const { return int(m_levels.size()); }
  HeightRange at(int level, int i, int j) const { return {least(level, i, j), greatest(level, i, j)}; }

  /// The halves of at(). They lie apart: what comes from above needs but the one.
  float least(int level, int i, int j) const {
    const Level& blocks = m_levels[size_t(level - 1)];
    return blocks.least[blocks.index(i, j)];
  }
  float greatest(int level, int i, int j) const {
    const Level& blocks = m_levels[size_t(level - 1)];
    return blocks.greatest[blocks.index(i, j)];
  }

  int width(int level) const { return m_levels[size_t(level - 1)].width; }
  int height(int level) const { return m_levels[size_t(level - 1)].height; }
  HeightRange all() const { return at(top(), 0, 0); }

  /// Bounds of the surface between two map points, which are clamped to the map: of at most 3 x 3 blocks.
  HeightRange between(double u0, double v0, double u1, double v1) const;

 private:
  struct Level {
    int width = 0, height = 0;
    LargeArray<float> least, greatest;

    size_t index(int i, int j) const { return size_t(j) * size_t(width) + size_t(i); }
  };

  void add_level(int width, int height);
  void merge_rows(int level, int first, int end);

  std::vector<Level> m_levels;
};

}  // namespace pileus
