#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "lib/terrain/height_table.h"

namespace pileus {

/// Least and greatest height of a part of the surface; empty (least > greatest) where there is none.
struct HeightRange {
  float least = std::numeric_limits<float>::infinity();
  float greatest = -std::numeric_limits<float>::infinity();

  bool empty() const { return !(least <= greatest); }
  void extend(float z) { least = std::min(least, z), greatest = std::max(greatest, z); }
  void extend(const HeightRange& other) {
    least = std::min(least, other.least), greatest = std::max(greatest, other.greatest);
  }
};

/// Bounds of the interpolated surface over blocks of 2^level x 2^level cells, for levels from 1 up to one
/// block for all: of all nodes that a cell touches, the shared rows and columns included. A cell with a
/// corner without data has no surface. ref: METHODS 6.3
class HeightPyramid {
 public:
  HeightPyramid() = default;
  explicit HeightPyramid(const HeightTable& table);

  int top() const { return int(m_levels.size()); }
  const HeightRange& at(int level, int i, int j) const {
    const Level& blocks = m_levels[size_t(level - 1)];
    return blocks.ranges[size_t(j) * size_t(blocks.width) + size_t(i)];
  }
  int width(int level) const { return m_levels[size_t(level - 1)].width; }
  int height(int level) const { return m_levels[size_t(level - 1)].height; }
  const HeightRange& all() const { return at(top(), 0, 0); }

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<HeightRange> ranges;
  };
  std::vector<Level> m_levels;
};

}  // namespace pileus
