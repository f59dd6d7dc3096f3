#include "lib/terrain/height_pyramid.h"

namespace pileus {
namespace {

HeightRange cell_range(const HeightTable& table, int i, int j) {
  HeightRange range;
  if (i >= table.cells_x() || j >= table.cells_y()) return range;
  const float* z = table.heights.data() + size_t(j) * size_t(table.columns) + size_t(i);
  const float corners[] = {z[0], z[1], z[table.columns], z[table.columns + 1]};
  for (const float corner : corners) {
    if (std::isnan(corner)) return {};
    range.extend(corner);
  }
  return range;
}

}  // namespace

HeightPyramid::HeightPyramid(const HeightTable& table) {
  int width = table.cells_x(), height = table.cells_y();
  do {
    const int below_width = width, below_height = height;
    width = (width + 1) / 2, height = (height + 1) / 2;
    Level level{width, height, std::vector<HeightRange>(size_t(width) * size_t(height))};
    const bool is_finest = m_levels.empty();
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) {
        HeightRange& range = level.ranges[size_t(j) * size_t(width) + size_t(i)];
        for (int k = 0; k < 4; ++k) {
          const int x = 2 * i + (k & 1), y = 2 * j + (k >> 1);
          if (is_finest) {
            range.extend(cell_range(table, x, y));
          } else if (x < below_width && y < below_height) {
            range.extend(at(top(), x, y));
          }
        }
      }
    }
    m_levels.push_back(std::move(level));
  } while (width > 1 || height > 1);
}

}  // namespace pileus
