#pragma once

#include "lib/scene/world.h"

namespace pileus {

/// How far apart the rays of neighbouring pixels are: a pixel's cone.
struct PixelCone {
  double at_camera = 0.0;  ///< [m]
  double per_metre = 0.0;

  /// Width at a distance from the camera [m].
  double width(double distance) const { return at_camera + per_metre * distance; }
};

/// The cone of one pixel, towards the nearer of the pixels beside and below.
PixelCone pixel_cone(const Camera& camera, const Vec2d& pixel, const Vec2i& picture);

/// The cone in the middle of a picture, where it is widest; nothing for a picture without a size.
PixelCone middle_pixel_cone(const World& world, const Vec2i& picture);

}  // namespace pileus
