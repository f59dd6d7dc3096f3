#include "lib/terrain/coarse_patches.h"

#include <bit>
#include <cmath>
#include <utility>

#include "lib/core/parallel.h"
#include "lib/terrain/cubic_patch.h"

namespace pileus {
namespace {

constexpr int kUnit = CoarsePatches::kUnit;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

using Corners = std::array<HeightTable, CoarsePatches::kCoarsest>;

/// Deviations of the patches of some levels, in whole blocks beside each other, from the nodes there: between
/// nodes, where both are bilinear, they are not larger.
template <int block_level, int... levels>
class BlockRow {
 public:
  static constexpr int kCells = 1 << block_level;
  static constexpr int kMostNodes = 1024;  ///< in a row: what is kept of them stays in the nearest cache
  static constexpr int kMost = kMostNodes >> block_level;  ///< blocks

  ///   first, count: of the blocks, j: their row
  BlockRow(const HeightTable& table, const Corners& corners, int first, int count, int j)
      : m_table(table), m_corners(corners), m_first(first), m_count(count) {
    for (auto& columns : m_most) columns.fill(0.0F);
    for (int row = 0; row <= kCells; ++row) {
      note_holes(j * kCells + row);
      size_t place = 0;
      (compare<levels>(j, row, m_most[place++].data()), ...);
    }
  }

  /// Of a block, from the first.
  std::array<float, sizeof...(levels)> most(int block) const {
    std::array<float, sizeof...(levels)> most{};
    const auto first = size_t(block * kCells);
    for (size_t place = 0; place < most.size(); ++place) {
      for (size_t k = first; k <= first + kCells; ++k) most[place] = std::max(most[place], m_most[place][k]);
    }
    float holes = 0.0F;
    for (size_t k = first; k <= first + kCells; ++k) holes += m_holes[k];
    if (std::isnan(holes)) most.fill(kInfinity);
    return most;
  }

 private:
  const float* heights(int row) const {
    return m_table.heights.data() + size_t(row) * size_t(m_table.columns) + size_t(m_first * kCells);
  }

  void note_holes(int row) {
    const float* z = heights(row);
    for (size_t k = 0; k <= size_t(m_count * kCells); ++k) m_holes[k] += 0.0F * z[k];  // NaN as soon as z is
  }

  template <int level>
  void compare(int j, int row, float* most) {
    constexpr int kWidth = 1 << level, kPatches = kCells / kWidth;
    const HeightTable& corners = m_corners[size_t(level - 1)];
    // The last row of nodes is the lower side of the last patches.
    const int patch = std::min(row / kWidth, kPatches - 1);
    const float down = float(row - patch * kWidth) / float(kWidth);
    const float* above = corners.heights.data() + size_t(j * kPatches + patch) * size_t(corners.columns) +
                         size_t(m_first * kPatches);
    const float* below = above + corners.columns;
    const float* z = heights(j * kCells + row);
    float west = lerp(above[0], below[0], down);
    for (int i = 0; i < m_count * kPatches; ++i, z += kWidth, most += kWidth) {
      const float east = lerp(above[i + 1], below[i + 1], down), step = (east - west) / float(kWidth);
      for (int k = 0; k < kWidth; ++k) most[k] = std::max(most[k], std::abs(z[k] - (west + float(k) * step)));
      west = east;
    }
    most[0] = std::max(most[0], std::abs(z[0] - west));
  }

  const HeightTable& m_table;
  const Corners& m_corners;
  int m_first, m_count;
  std::array<std::array<float, kMostNodes + 1>, sizeof...(levels)> m_most;
  std::array<float, kMostNodes + 1> m_holes{};
};

/// The same of one level in one block, which the end of the map may cut.
float most_in_block(const HeightTable& table, int block_level, int level, int i, int j) {
  const int u_end = std::min((i + 1) << block_level, table.cells_x()),
            v_end = std::min((j + 1) << block_level, table.cells_y());
  float most = 0.0F;
  for (int v = j << block_level; v <= v_end; ++v) {
    for (int u = i << block_level; u <= u_end; ++u) {
      const int x = std::min(u, u_end - 1) >> level, y = std::min(v, v_end - 1) >> level;
      const int u0 = x << level, u1 = std::min((x + 1) << level, u_end), v0 = y << level,
                v1 = std::min((y + 1) << level, v_end);
      const double s = double(u - u0) / (u1 - u0), r = double(v - v0) / (v1 - v0);
      const double off = std::abs(double(table.at(u, v)) - table.patch(level, x, y).at(s, r));
      if (std::isnan(off)) return kInfinity;
      most = std::max(most, float(off));
    }
  }
  return most;
}

/// Calls keep(i, j, deviations) for every block, on all cores.
template <int block_level, int... levels, class Keep>
void for_blocks(const HeightTable& table, const Corners& corners, Keep&& keep) {
  using Row = BlockRow<block_level, levels...>;
  const int width = corners[block_level - 1].cells_x(), height = corners[block_level - 1].cells_y();
  parallel_for(size_t(height), [&](size_t row) {
    const int j = int(row);
    const int whole = (j + 1) * Row::kCells <= table.cells_y() ? table.cells_x() / Row::kCells : 0;
    for (int first = 0; first < whole; first += Row::kMost) {
      const int count = std::min(Row::kMost, whole - first);
      const Row blocks(table, corners, first, count, j);
      for (int k = 0; k < count; ++k) keep(first + k, j, blocks.most(k));
    }
    for (int i = whole; i < width; ++i)
      keep(i, j, std::array<float, sizeof...(levels)>{most_in_block(table, block_level, levels, i, j)...});
  });
}

/// How far the surface of a cell lies from the bilinear patch between its corners: as far as their control
/// values, of which the one has the other's hull.
double cubic_deviation(const HeightTable& table, int i, int j) {
  const Patch<double> flat = table.patch(i, j);
  if (!flat.has_data()) return double(kInfinity);
  const CubicPatch::Control control = CubicPatch(table, i, j).control();
  double most = 0.0;
  for (size_t row = 0; row < 4; ++row) {
    for (size_t column = 0; column < 4; ++column)
      most =
          std::max(most, std::abs(control[row][column] - flat.at(double(column) / 3.0, double(row) / 3.0)));
  }
  return most;
}

/// By how much the surface deviates from that of bilinear cells, in each unit.
class CubicDeviations {
 public:
  CubicDeviations(const HeightTable& table, HeightInterpolation interpolation, int width, int height)
      : m_width(width), m_height(height) {
    if (interpolation != HeightInterpolation::bicubic) return;
    m_units.resize(size_t(width) * size_t(height));
    parallel_for(size_t(height), [&](size_t j) {
      for (int v = int(j) << kUnit; v < std::min((int(j) + 1) << kUnit, table.cells_y()); ++v) {
        for (int u = 0; u < table.cells_x(); ++u) {
          double& unit = m_units[j * size_t(width) + size_t(u >> kUnit)];
          unit = std::max(unit, cubic_deviation(table, u, v));
        }
      }
    });
  }

  /// In a block of a level from kUnit.
  double in_block(int level, int i, int j) const {
    if (m_units.empty()) return 0.0;
    const int up = level - kUnit;
    double most = 0.0;
    for (int y = j << up; y < std::min((j + 1) << up, m_height); ++y) {
      for (int x = i << up; x < std::min((i + 1) << up, m_width); ++x)
        most = std::max(most, m_units[size_t(y) * size_t(m_width) + size_t(x)]);
    }
    return most;
  }

 private:
  int m_width, m_height;
  std::vector<double> m_units;
};

uint16_t upper_half(float x) {
  return uint16_t(std::bit_cast<uint32_t>(x) >> 16);
}

/// Of the float after that of a sum: not below it.
uint16_t upper_half_above(double sum) {
  return std::min(uint16_t(upper_half(float(sum)) + 1), upper_half(kInfinity));
}

}  // namespace

CoarsePatches::CoarsePatches(const HeightTable& table, HeightInterpolation interpolation, float highest) {
  for (int level = 1; level <= kCoarsest; ++level) add_corners(table, level);
  const HeightTable& units = m_corners[kUnit - 1];
  const CubicDeviations cubic(table, interpolation, units.cells_x(), units.cells_y());
  // Of differences in floats, with room to spare.
  const double rounding = 8.0 * double(std::numeric_limits<float>::epsilon()) * double(highest);
  const auto make = [&]<class T>(LargeArray<T>& blocks, int level) {
    const HeightTable& corners = m_corners[size_t(level - 1)];
    blocks = make_large_array<T>(size_t(corners.cells_x()) * size_t(corners.cells_y()));
  };
  make(m_units, kUnit);
  for_blocks<kUnit, 1, 2, 3>(table, m_corners, [&](int i, int j, const std::array<float, kUnit>& most) {
    const double more = cubic.in_block(kUnit, i, j) + rounding;
    Deviations& unit = m_units[size_t(j) * size_t(units.cells_x()) + size_t(i)];
    float so_far = 0.0F;
    for (size_t k = 0; k < most.size(); ++k) {
      so_far = std::max(so_far, most[k]);
      unit[k] = upper_half_above(double(so_far) + more);
    }
  });
  const auto add_large = [&]<int level>(std::integral_constant<int, level>) {
    LargeArray<uint16_t>& blocks = m_large[size_t(level - kUnit - 1)];
    make(blocks, level);
    for_blocks<level, level>(table, m_corners, [&](int i, int j, const std::array<float, 1>& most) {
      blocks[size_t(j) * size_t(m_corners[size_t(level - 1)].cells_x()) + size_t(i)] =
          upper_half_above(double(most[0]) + cubic.in_block(level, i, j) + rounding);
    });
  };
  add_large(std::integral_constant<int, 4>());
  add_large(std::integral_constant<int, 5>());
  static_assert(kUnit == 3 && kCoarsest == 5);
}

/// From the corners of the next finer level, of which they are every other; the last are those of the map.
void CoarsePatches::add_corners(const HeightTable& table, int level) {
  const HeightTable& finer = level == 1 ? table : m_corners[size_t(level - 2)];
  HeightTable& corners = m_corners[size_t(level - 1)];
  corners.columns = (finer.cells_x() + 1) / 2 + 1, corners.rows = (finer.cells_y() + 1) / 2 + 1;
  corners.heights.resize(size_t(corners.columns) * size_t(corners.rows));
  parallel_for(size_t(corners.rows), [&](size_t j) {
    const int row = std::min(2 * int(j), finer.rows - 1);
    const float* from = finer.heights.data() + size_t(row) * size_t(finer.columns);
    float* to = corners.heights.data() + j * size_t(corners.columns);
    for (int i = 0; i + 1 < corners.columns; ++i) to[i] = from[2 * i];
    to[corners.columns - 1] = from[finer.columns - 1];
  });
}

float CoarsePatches::deviation(int level, int i, int j) const {
  const uint16_t upper_half =
      level > kUnit
          ? large(level, i, j)
          : m_units[size_t(j) * size_t(m_corners[kUnit - 1].cells_x()) + size_t(i)][size_t(level - 1)];
  return std::bit_cast<float>(uint32_t(upper_half) << 16);
}

CoarsePatches::Allowance CoarsePatches::allowance(double heights) {
  constexpr double kRoundedDown = 1.0 - 1e-7, kMost = double(std::numeric_limits<float>::max());
  return {upper_half(float(std::min(heights * kRoundedDown, kMost)))};
}

}  // namespace pileus
