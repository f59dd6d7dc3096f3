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

/// A float that is not below a sum of deviations, whatever rounding did to it.
float rounded_up(double sum) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return sum > 0.0 ? std::nextafter(float(sum * (1.0 + 1e-12)), kInfinity) : 0.0F;
}

constexpr size_t kStepOfOne = 128;

/// 0, quarters of octaves around 1, infinity.
std::array<float, 256> deviation_steps() {
  std::array<float, 256> steps{};
  for (size_t k = 1; k < steps.size(); ++k)
    steps[k] = float(std::exp2(0.25 * (double(k) - double(kStepOfOne))));
  steps.back() = std::numeric_limits<float>::infinity();
  return steps;
}

/// The first step that is not below a deviation.
uint8_t step_of(const std::array<float, 256>& steps, float deviation) {
  if (!(deviation > 0.0F)) return 0;
  if (deviation > steps[steps.size() - 2]) return uint8_t(steps.size() - 1);
  const int octave = std::max(std::ilogb(deviation), -31);
  auto step = size_t(4 * octave + int(kStepOfOne));
  while (step > 1 && steps[step - 1] >= deviation) --step;
  while (steps[step] < deviation) ++step;
  return uint8_t(step);
}

/// How far the surface of a cell lies from the bilinear patch between its corners: as far as their control
/// values, of which the one has the other's hull.
float cell_deviation(const HeightTable& table, HeightInterpolation interpolation, int i, int j) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const Patch<double> flat = table.patch(i, j);
  if (!flat.has_data()) return kInfinity;
  if (interpolation == HeightInterpolation::bilinear) return 0.0F;
  const CubicPatch::Control control = CubicPatch(table, i, j).control();
  double most = 0.0;
  for (size_t row = 0; row < 4; ++row) {
    for (size_t column = 0; column < 4; ++column)
      most =
          std::max(most, std::abs(control[row][column] - flat.at(double(column) / 3.0, double(row) / 3.0)));
  }
  return rounded_up(most);
}

/// Of 2 x 2 bilinear cells from the patch between their corners: at the five nodes inside.
float deviation_of_four(const HeightTable& table, int i, int j) {
  const float* rows[3];
  for (int k = 0; k < 3; ++k)
    rows[k] = table.heights.data() + size_t(2 * j + k) * size_t(table.columns) + size_t(2 * i);
  const auto z = [&](int row, int column) { return double(rows[row][column]); };
  const double west = 0.5 * (z(0, 0) + z(2, 0)), east = 0.5 * (z(0, 2) + z(2, 2));
  const double off[5] = {z(0, 1) - 0.5 * (z(0, 0) + z(0, 2)), z(2, 1) - 0.5 * (z(2, 0) + z(2, 2)),
                         z(1, 0) - west, z(1, 2) - east, z(1, 1) - 0.5 * (west + east)};
  double most = 0.0, sum = 0.0;
  for (const double d : off) most = std::max(most, std::abs(d)), sum += d;
  return std::isnan(sum) ? std::numeric_limits<float>::infinity() : rounded_up(most);
}

/// Ranges of rows of blocks of 2 x 2 cells. Keeps its memory from row to row.
class FinestRows {
 public:
  FinestRows(const HeightTable& table, HeightInterpolation interpolation)
      : m_table(table),
        m_interpolation(interpolation),
        m_least(size_t(table.columns)),
        m_greatest(size_t(table.columns)) {}

  void fill(int j, HeightRange* blocks, int width) {
    if (m_interpolation != HeightInterpolation::bilinear || !fill_columns(j))
      return fill_by_cells(j, blocks, width);
    const int last = m_table.columns - 1;
    for (int i = 0; i < last / 2; ++i) {
      const size_t k = 2 * size_t(i);
      blocks[i] = {std::min({m_least[k], m_least[k + 1], m_least[k + 2]}),
                   std::max({m_greatest[k], m_greatest[k + 1], m_greatest[k + 2]})};
    }
    if (last % 2 == 0) return;
    const auto k = size_t(last);
    blocks[width - 1] = {std::min(m_least[k - 1], m_least[k]), std::max(m_greatest[k - 1], m_greatest[k])};
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

  void fill_by_cells(int j, HeightRange* blocks, int width) const {
    for (int i = 0; i < width; ++i) {
      blocks[i] = {};
      for (int k = 0; k < 4; ++k)
        blocks[i].extend(cell_range(m_table, m_interpolation, 2 * i + (k & 1), 2 * j + (k >> 1)));
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

HeightPyramid::HeightPyramid(const HeightTable& table, HeightInterpolation interpolation,
                             bool with_deviations) {
  add_level((table.cells_x() + 1) / 2, (table.cells_y() + 1) / 2);
  const Level& finest = m_levels.front();
  for_bands(finest.height, rows_of_band(finest.width), [&](int first, int end) {
    FinestRows rows(table, interpolation);
    for (int j = first; j < end; ++j)
      rows.fill(j, finest.ranges.get() + size_t(j) * size_t(finest.width), finest.width);
  });
  while (width(top()) > 1 || height(top()) > 1) {
    add_level((width(top()) + 1) / 2, (height(top()) + 1) / 2);
    for_bands(height(top()), rows_of_band(width(top())),
              [&](int first, int end) { merge_rows(top(), first, end); });
  }
  if (!with_deviations) return;
  m_deviation_steps = deviation_steps();
  for (int level = 1; level <= top(); ++level) {
    add_deviations(table, interpolation, level);
    if (level <= kCoarsestPatch) add_corners(table, level);
  }
}

void HeightPyramid::add_corners(const HeightTable& table, int level) {
  Level& blocks = m_levels[size_t(level - 1)];
  const int columns = blocks.width + 1, rows = blocks.height + 1;
  blocks.corners = {columns, rows, HeightValues(size_t(columns) * size_t(rows))};
  for_bands(rows, rows_of_band(columns), [&](int first, int end) {
    for (int j = first; j < end; ++j) {
      float* to = blocks.corners.heights.data() + size_t(j) * size_t(columns);
      for (int i = 0; i < columns; ++i)
        to[i] = table.at(std::min(i << level, table.cells_x()), std::min(j << level, table.cells_y()));
    }
  });
}

void HeightPyramid::add_deviations(const HeightTable& table, HeightInterpolation interpolation, int level) {
  Level& blocks = m_levels[size_t(level - 1)];
  blocks.deviations = make_large_array<uint8_t>(size_t(blocks.width) * size_t(blocks.height));
  for_bands(blocks.height, rows_of_band(blocks.width), [&](int first, int end) {
    for (int j = first; j < end; ++j) {
      for (int i = 0; i < blocks.width; ++i) {
        blocks.deviations[size_t(j) * size_t(blocks.width) + size_t(i)] =
            step_of(m_deviation_steps, deviation_inside(table, interpolation, level, i, j));
      }
    }
  });
}

/// By how much the patches of the block's quarters deviate from the surface, and the block's own from those:
/// on each quarter both are bilinear, so that they differ most at a quarter's corner.
float HeightPyramid::deviation_inside(const HeightTable& table, HeightInterpolation interpolation, int level,
                                      int i, int j) const {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const bool is_whole = 2 * i + 2 <= table.cells_x() && 2 * j + 2 <= table.cells_y();
  if (level == 1 && is_whole && interpolation == HeightInterpolation::bilinear)
    return deviation_of_four(table, i, j);
  const int u[2] = {i << level, std::min((i + 1) << level, table.cells_x())};
  const int v[2] = {j << level, std::min((j + 1) << level, table.cells_y())};
  const int middle_u = std::min((2 * i + 1) << (level - 1), u[1]),
            middle_v = std::min((2 * j + 1) << (level - 1), v[1]);
  float inside = 0.0F;
  for (int k = 0; k < 4; ++k) {
    const int x = 2 * i + (k & 1), y = 2 * j + (k >> 1);
    if ((x << (level - 1)) >= u[1] || (y << (level - 1)) >= v[1]) continue;
    inside =
        std::max(inside, level > 1 ? deviation(level - 1, x, y) : cell_deviation(table, interpolation, x, y));
  }
  if (std::isinf(inside)) return kInfinity;
  const Patch<double> patch = table.patch(level, i, j);
  const double s = double(middle_u - u[0]) / (u[1] - u[0]), r = double(middle_v - v[0]) / (v[1] - v[0]);
  double own = 0.0;
  const auto compare = [&](int column, int row, double at_s, double at_r) {
    own = std::max(own, std::abs(double(table.at(column, row)) - patch.at(at_s, at_r)));
  };
  compare(middle_u, v[0], s, 0.0);
  compare(middle_u, v[1], s, 1.0);
  compare(u[0], middle_v, 0.0, r);
  compare(u[1], middle_v, 1.0, r);
  compare(middle_u, middle_v, s, r);
  return rounded_up(double(inside) + own);
}

HeightRange HeightPyramid::between(double u0, double v0, double u1, double v1, int least_level) const {
  const double size = std::max({u1 - u0, v1 - v0, 1.0});
  const int level = std::min(std::max(int(std::ilogb(size)), least_level), top());
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
  m_levels.push_back(
      {width, height, make_large_array<HeightRange>(size_t(width) * size_t(height)), nullptr, {}});
}

void HeightPyramid::merge_rows(int level, int first, int end) {
  const Level& to = m_levels[size_t(level - 1)];
  const int last_x = width(level - 1) - 1, last_y = height(level - 1) - 1;
  for (int j = first; j < end; ++j) {
    for (int i = 0; i < to.width; ++i) {
      HeightRange& range = to.ranges[size_t(j) * size_t(to.width) + size_t(i)];
      range = at(level - 1, 2 * i, 2 * j);
      const int x = std::min(2 * i + 1, last_x), y = std::min(2 * j + 1, last_y);
      range.extend(at(level - 1, x, 2 * j));
      range.extend(at(level - 1, 2 * i, y));
      range.extend(at(level - 1, x, y));
    }
  }
}

}  // namespace pileus
