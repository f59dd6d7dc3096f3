#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lib/math/segments.h"
#include "lib/scene/world.h"

namespace pileus {

/// How thoroughly shadows are looked for, in optical depths of haze.
struct SearchDetail {
  double least_depth;       ///< what is shaded for less may be missed
  double negligible_depth;  ///< there is no point in looking closer
};

/// A ray along which they are looked for.
struct SearchedRay {
  Ray ray;
  Segment media;           ///< all media lie in it
  Segments may_be_shaded;  ///< parts of that; the solid surely shades nothing else
  double longest_step;     ///< [m]
  double* left_out;  ///< optical depth in which shadows have not been looked for, of all solids together: it
                     ///< is kept below the negligible
};

/// Looks for the shadows of a solid that cannot tell where they begin and end, along the rays of a packet.
/// All rays are asked at once: first at equal distances, then in halves where the answer changes.
///
/// What is shaded for less than a step may be missed. A step is a voxel of the grids that are there, or
/// `least_depth` of haze, and not longer than `longest_step`; but where there is haze alone, not shorter than
/// `negligible_depth`. Edges err by a 16th of the latter or by a 4096th of a step.
///
///   towards_sun: unit vector
///   shadows: gets the shaded stretches of each ray
/// Returns the number of shadow rays this took.
uint64_t search_shadows(const World& world, const SearchDetail& detail, const Shape& solid,
                        const Vec3d& towards_sun, std::span<const SearchedRay> rays,
                        std::span<Segments> shadows);

/// Which of some points the solid hides a sun from.
///   towards_sun: unit vector
std::vector<char> are_shaded(const Shape& solid, const Vec3d& towards_sun, std::span<const Vec3d> points);

/// The same for any light.
std::vector<char> are_shaded(const Shape& solid, const Light& light, std::span<const Vec3d> points);

}  // namespace pileus
