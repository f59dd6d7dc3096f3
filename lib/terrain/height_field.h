#pragma once

#include <optional>

#include "lib/math/beam.h"
#include "lib/math/ray.h"
#include "lib/terrain/height_pyramid.h"
#include "lib/terrain/height_table.h"

namespace pileus {

/// Where a ray meets the surface, in grid space.
struct HeightHit {
  double t = 0.0;             ///< of the ray's own parameter
  double u = 0.0, v = 0.0;    ///< column and row, with fractions
  double z = 0.0;             ///< height
  double du = 0.0, dv = 0.0;  ///< slope of the surface there [height per cell]
};

/// The surface of bilinear patches over a table of heights, a sheet without thickness that is seen from both
/// sides. Space is that of the grid: u in columns, v in rows, z in heights.
///
/// A ray is met by bisection: a block of cells is left out where the ray passes wholly above its greatest
/// or below its least height, else it is cut at its middle lines, down to single cells, where height along
/// the ray is a quadratic. The parameters at which a ray passes from cell to cell follow from the integers of
/// the grid lines, and both neighbours compute the same height difference there, bit for bit: as a hit is a
/// change of its sign, no ray slips through between two cells. ref: METHODS 6, 13
class HeightField {
 public:
  HeightField() = default;
  explicit HeightField(HeightTable table) : m_table(std::move(table)), m_pyramid(m_table) {}

  const HeightTable& table() const { return m_table; }
  HeightRange range() const { return m_pyramid.all(); }

  /// Height at a map point; NaN where there is no surface. u, v are clamped to the map.
  double height(double u, double v) const;

  /// The first hit with t in (segment.t0, segment.t1) and a height of at least `lowest`.
  ///   ray: in grid space; d of any length but 0
  ///   clear: the ray is known to meet nothing before this t; it does not change the answer
  std::optional<HeightHit> intersect(const Ray& ray, Segment segment, double lowest,
                                     double clear = 0.0) const;

  /// A t before which all rays of a beam are above the surface or beside the map; infinite where none meets
  /// it.
  double clear_distance(const Beam& beam) const;

 private:
  HeightTable m_table;
  HeightPyramid m_pyramid;
};

}  // namespace pileus
