#include "lib/terrain/height_pyramid.h"

#include <array>
#include <cmath>

#include "lib/core/parallel.h"
#include "lib/terrain/cubic_patch.h"

namespace pileus {
namespace {

HeightRange cell_range(const HeightTable& table, HeightInterpolation interpolation, int i, int j) {
  HeightRange range;
  if (i >= table.cells_x() || j >= table.cells_y()) return range;
  if (interpolation == HeightInterpolation::bicubic) return cubic_range(CubicPatch(table, i, j));
  const float* z = table.heights.data() + size_t(j) * size_t(table.columns) + size_t(i);
  const float corners[] = {z[0], z[1], z[table.columns], z[table.columns + 1]};
  for (const float corner : corners) {
    if (std::isnan(corner)) return {};
    range.extend(corner);
  }
  return range;
}

/// Ranges of rows of blocks of 2 x 2 cells. Keeps its memory from row to row.
class FinestRows {
 public:
  FinestRows(const HeightTable& table, HeightInterpolation interpolation)
      : m_table(table),
        m_interpolation(interpolation),
        m_least(size_t(table.columns)),
        m_greatest(size_t(table.columns)) {}

  ///   least, greatest: of each block of row j
  void fill(int j, float* least, float* greatest, int width) {
    if (m_interpolation != HeightInterpolation::bilinear || !fill_columns(j))
      return fill_by_cells(j, least, greatest, width);
    const int last = m_table.columns - 1;
    for (int i = 0; i < last / 2; ++i) {
      const size_t k = 2 * size_t(i);
      least[i] = std::min({m_least[k], m_least[k + 1], m_least[k + 2]});
      greatest[i] = std::max({m_greatest[k], m_greatest[k + 1], m_greatest[k + 2]});
    }
    if (last % 2 == 0) return;
    const auto k = size_t(last);
    least[width - 1] = std::min(m_least[k - 1], m_least[k]);
    greatest[width - 1] = std::max(m_greatest[k - 1], m_greatest[k]);
  }

 private:
  /// Over the three rows of nodes that the row of blocks touches; false where some have no data.
  bool fill_columns(int j) {
    const auto columns = size_t(m_table.columns);
    const float* rows[3];
    for (int k = 0; k < 3; ++k)
      rows[k] = m_table.heights.data() + size_t(std::min(2 * j + k, m_table.rows - 1)) * columns;
    float sum = 0.0F;  // NaN as soon as one term is: 0 * z is 0 for any other
    for (size_t i = 0; i < columns; ++i) {
      const float a = rows[0][i], b = rows[1][i], c = rows[2][i];
      m_least[i] = std::min(std::min(a, b), c);
      m_greatest[i] = std::max(std::max(a, b), c);
    }
    constexpr size_t kLanes = 16;
    std::array<float, kLanes> sums{};
    for (size_t i = 0; i + kLanes <= columns; i += kLanes) {
      for (size_t lane = 0; lane < kLanes; ++lane)
        sums[lane] += 0.0F * (rows[0][i + lane] + (rows[1][i + lane] + rows[2][i + lane]));
    }
    for (size_t i = columns / kLanes * kLanes; i < columns; ++i)
      sum += 0.0F * (rows[0][i] + (rows[1][i] + rows[2][i]));
    for (const float lane : sums) sum += lane;
    return !std::isnan(sum);
  }

  void fill_by_cells(int j, float* least, float* greatest, int width) const {
    for (int i = 0; i < width; ++i) {
      HeightRange block;
      for (int k = 0; k < 4; ++k)
        block.extend(cell_range(m_table, m_interpolation, 2 * i + (k & 1), 2 * j + (k >> 1)));
      least[i] = block.least, greatest[i] = block.greatest;
    }
  }

  const HeightTable& m_table;
  HeightInterpolation m_interpolation;
  std::vector<float> m_least, m_greatest;
};

/// Calls body(first, end) for bands of rows, on all cores.
template <class Body>
void for_bands(int rows, int rows_per_band, Body&& body) {
  parallel_for(size_t((rows + rows_per_band - 1) / rows_per_band), [&](size_t band) {
    const int first = int(band) * rows_per_band;
    body(first, std::min(rows, first + rows_per_band));
  });
}

/// Rows that make a task worth its while.
int rows_of_band(int width) {
  constexpr int kBlocks = 1 << 15;
  return std::max(1, kBlocks / width);
}

}  // namespace

HeightPyramid::HeightPyramid(const HeightTable& table, HeightInterpolation interpolation) {
  add_level((table.cells_x() + 1) / 2, (table.cells_y() + 1) / 2);
  const Level& finest = m_levels.front();
  for_bands(finest.height, rows_of_band(finest.width), [&](int first, int end) {
    FinestRows rows(table, interpolation);
    for (int j = first; j < end; ++j) {
      const size_t at = finest.index(0, j);
      rows.fill(j, finest.least.get() + at, finest.greatest.get() + at, finest.width);
    }
  });
  while (width(top()) > 1 || height(top()) > 1) {
    add_level((width(top()) + 1) / 2, (height(top()) + 1) / 2);
    for_bands(height(top()), rows_of_band(width(top())),
              [&](int first, int end) { merge_rows(top(), first, end); });
  }
}

HeightRange HeightPyramid::between(double u0, double v0, double u1, double v1) const {
  const double size = std::max({u1 - u0, v1 - v0, 1.0});
  const int level = std::min(std::max(int(std::ilogb(size)), 1), top());
  const double scale = std::ldexp(1.0, -level);
  const auto block = [&](double u, int count) { return int(std::clamp(u * scale, 0.0, double(count - 1))); };
  const int i1 = block(u1, width(level)), j1 = block(v1, height(level));
  HeightRange range;
  for (int j = block(v0, height(level)); j <= j1; ++j) {
    for (int i = block(u0, width(level)); i <= i1; ++i) range.extend(at(level, i, j));
  }
  return range;
}

void HeightPyramid::add_level(int width, int height) {
  m_levels.push_back({width, height, make_large_array<float>(size_t(width) * size_t(height)),
                      make_large_array<float>(size_t(width) * size_t(height))});
}

void HeightPyramid::merge_rows(int level, int first, int end) {
  const Level& to = m_levels[size_t(level - 1)];
  const int last_x = width(level - 1) - 1, last_y = height(level - 1) - 1;
  for (int j = first; j < end; ++j) {
    for (int i = 0; i < to.width; ++i) {
      HeightRange range = at(level - 1, 2 * i, 2 * j);
      const int x = std::min(2 * i + 1, last_x), y = std::min(2 * j + 1, last_y);
      range.extend(at(level - 1, x, 2 * j));
      range.extend(at(level - 1, 2 * i, y));
      range.extend(at(level - 1, x, y));
      to.least[to.index(i, j)] = range.least, to.greatest[to.index(i, j)] = range.greatest;
    }
  }
}

}  // namespace pileus
