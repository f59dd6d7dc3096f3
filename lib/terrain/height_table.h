#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "lib/core/large_array.h"
#include "lib/math/lerp.h"

namespace pileus {

/// Where a map coordinate lies: its cell and how far in, 0 to 1.
template <class T>
struct MapCell {
  int cell = 0;
  T fraction = 0;
};

/// The cell below u, by floor: -0.25 lies in cell -1. ref: METHODS 6.2
template <class T>
MapCell<T> map_cell(T u) {
  const T cell = std::floor(u);
  return {int(cell), u - cell};
}

/// The same for a coordinate of a row of `cells` cells: beyond its ends, the nearest end.
template <class T>
MapCell<T> map_cell(T u, int cells) {
  if (!(u > 0)) return {0, T(0)};
  if (u >= T(cells)) return {cells - 1, T(1)};
  return map_cell(u);
}

/// The four corner heights of a cell, [row][column].
template <class T>
struct Patch {
  T z00, z10, z01, z11;  ///< z(column)(row)

  /// Bilinear height: exact at the corners, and on an edge a function of that edge alone, so that
  /// neighbours agree bit for bit. s along columns, r along rows, both 0 to 1.
  T at(T s, T r) const { return lerp(lerp(z00, z10, s), lerp(z01, z11, s), r); }

  /// False where a corner has no data.
  bool has_data() const { return !std::isnan((z00 + z10) + (z01 + z11)); }
};

/// How heights go between nodes.
enum class HeightInterpolation {
  bilinear,
  bicubic,  ///< Catmull-Rom: through the nodes, without kinks, over and under them by up to 9/32 of their
            ///< range
};

using HeightValues = std::vector<float, LargeAllocator<float>>;

/// Heights at the nodes of a map: row 0 is the north edge, columns go east. NaN: no data there.
struct HeightTable {
  int columns = 0;  ///< nodes, >= 2
  int rows = 0;
  HeightValues heights;               ///< heights[row * columns + column] [m], or in units of the file
  double cell_x = 1.0, cell_y = 1.0;  ///< distance of nodes along a row and along a column [m]

  int cells_x() const { return columns - 1; }
  int cells_y() const { return rows - 1; }

  float at(int column, int row) const { return heights[size_t(row) * size_t(columns) + size_t(column)]; }

  /// cell in [0, cells_x()) x [0, cells_y())
  Patch<double> patch(int i, int j) const {
    const float* z = heights.data() + size_t(j) * size_t(columns) + size_t(i);
    return {z[0], z[1], z[columns], z[columns + 1]};
  }

  /// The patch that a block of 2^level x 2^level cells is seen as from afar: between its corners. Blocks at
  /// the far edges end where the map does.
  Patch<double> patch(int level, int i, int j) const {
    const int u0 = i << level, v0 = j << level;
    const int u1 = std::min((i + 1) << level, cells_x()), v1 = std::min((j + 1) << level, cells_y());
    return {at(u0, v0), at(u1, v0), at(u0, v1), at(u1, v1)};
  }
};

/// Refuses a table of fewer than 2 x 2 nodes, or one that, with its pyramid, exceeds the memory budget: ask
/// before allocating. errors: Error(file)
void check_table_size(const std::filesystem::path& file, int64_t columns, int64_t rows);

}  // namespace pileus
