#pragma once

#include <optional>

#include "lib/math/beam.h"
#include "lib/math/ray.h"
#include "lib/terrain/coarse_patches.h"
#include "lib/terrain/height_pyramid.h"
#include "lib/terrain/height_table.h"

namespace pileus {

/// Where a ray meets the surface, in grid space.
struct HeightHit {
  double t = 0.0;             ///< of the ray's own parameter
  double u = 0.0, v = 0.0;    ///< column and row, with fractions
  double z = 0.0;             ///< height
  double du = 0.0, dv = 0.0;  ///< slope of the surface there [height per cell]
  double deviation = 0.0;     ///< of the patch that was met from the surface, at most [heights]
};

/// What is known of a ray, and what of the surface it need not see.
struct HeightSight {
  double clear = 0.0;  ///< the ray meets nothing before this t; does not change the answer
  /// At t, a block of cells counts as one patch where the surface deviates from that by at most
  /// coarseness + t * coarsening [heights]. Only for a field that is made for it.
  double coarseness = 0.0, coarsening = 0.0;
  /// At t, rays of neighbouring pixels are about spacing + t * spreading apart [cells]. Does not change the
  /// answer.
  double spacing = 0.0, spreading = 0.0;
};

/// The surface over a table of heights, a sheet without thickness that is seen from both sides. Space is that
/// of the grid: u in columns, v in rows, z in heights.
///
/// A ray is met by bisection: a block of cells is left out where the ray passes wholly above its greatest
/// or below its least height, else it is cut at its middle lines, down to single cells, where height along
/// the ray is a quadratic, or of degree 6 between bicubic heights. The parameters at which a ray passes from
/// cell to cell follow from the integers of the grid lines, and both neighbours compute the same height
/// difference there, bit for bit: as a hit is a change of its sign, no ray slips through between two cells.
/// Seen from afar, blocks larger than a cell count as cells; where two of them do not meet, the gap between
/// them is a hit, so that nothing slips through there either. ref: METHODS 6, 13
class HeightField {
 public:
  HeightField() = default;
  ///   is_coarsened: rays may ask for less detail
  explicit HeightField(HeightTable table, HeightInterpolation interpolation = HeightInterpolation::bilinear,
                       bool is_coarsened = false)
      : m_table(std::move(table)),
        m_pyramid(m_table, interpolation),
        m_interpolation(interpolation),
        m_is_coarsened(is_coarsened) {
    if (is_coarsened) m_coarse = CoarsePatches(m_table, interpolation, highest());
  }

  const HeightTable& table() const { return m_table; }
  HeightRange range() const { return m_pyramid.all(); }

  /// Height at a map point; NaN where there is no surface. u, v are clamped to the map.
  double height(double u, double v) const;

  /// The first hit with t in (segment.t0, segment.t1) and a height of at least `lowest`.
  ///   ray: in grid space; d of any length but 0
  std::optional<HeightHit> intersect(const Ray& ray, Segment segment, double lowest,
                                     const HeightSight& sight = {}) const;

  /// A t before which all rays of a beam are above the surface or beside the map; infinite where none meets
  /// it.
  ///   sight: of all the rays; of it, what they need not see
  double clear_distance(const Beam& beam, const HeightSight& sight = {}) const;

 private:
  float highest() const { return std::max(std::abs(range().least), std::abs(range().greatest)); }

  HeightTable m_table;
  HeightPyramid m_pyramid;
  CoarsePatches m_coarse;  ///< where it is coarsened
  HeightInterpolation m_interpolation = HeightInterpolation::bilinear;
  bool m_is_coarsened = false;
};

}  // namespace pileus
