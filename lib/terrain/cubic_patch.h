#pragma once

#include <array>

#include "lib/terrain/height_range.h"
#include "lib/terrain/height_table.h"

namespace pileus {

/// Heights of one cell by Catmull-Rom's bicubic, from the 4 x 4 nodes around it. Where a node beside the cell
/// is missing - beyond the map, or without data - the line of the two nodes in front of it is continued. On
/// an edge the height is a function of that edge's own nodes alone: neighbours agree bit for bit.
class CubicPatch {
 public:
  /// cell in [0, cells_x()) x [0, cells_y())
  CubicPatch(const HeightTable& table, int i, int j);

  /// False where a corner has no data.
  bool has_data() const;

  /// s along columns, r along rows, both 0 to 1.
  double at(double s, double r) const;

  /// Slopes along s and r there.
  std::array<double, 2> slope(double s, double r) const;

  /// Bezier control heights, [row][column]: their hull holds the surface.
  using Control = std::array<std::array<double, 4>, 4>;
  Control control() const;

 private:
  void fill_borders();

  double m_z[4][4];  ///< [row][column]; the cell lies between 1 and 2
};

/// Bounds of the surface over a cell, rounded outwards; empty where it has no data.
HeightRange cubic_range(const CubicPatch& patch);

/// Heights along a straight line from (s0, r0) to (s1, r1) of the cell: Bernstein coefficients of degree 6.
std::array<double, 7> along_line(const CubicPatch::Control& control, double s0, double r0, double s1,
                                 double r1);

}  // namespace pileus
