#pragma once

#include <span>

#include "lib/math/vec.h"
#include "lib/texture/mip_pyramid.h"

namespace pileus {

/// The part of a surface that one pixel sees, as a parallelogram around a point: its edges.
struct SurfaceArea {
  Vec3d a, b;
};

/// What a ray `width` [m] wide covers on a surface: as long along the view as the surface is turned away, up
/// to 64 times.
///   n, wo: unit vectors, the normal and the way back along the ray
SurfaceArea seen_area(const Vec3d& n, const Vec3d& wo, double width);

/// The same in a picture.
struct PictureArea {
  Vec2d a{0.0, 0.0}, b{0.0, 0.0};
};

enum class TextureFilter {
  nearest,    ///< no filter: the texel at the place
  bilinear,   ///< the level whose texels are about as large as the area, interpolated
  trilinear,  ///< between the two levels whose texels are about as large as the area is narrow, at as many
              ///< places as it is longer than that, up to 16
};

/// The mean of a picture over an area, about. Continuous in the place and, but for a step where the number of
/// places changes, in the area. ref: McCormack et al. 1999, Feline
Texel filtered(const MipPyramid& pyramid, const Vec2d& uv, const PictureArea& area, const Wraps& wraps,
               TextureFilter filter);

}  // namespace pileus
