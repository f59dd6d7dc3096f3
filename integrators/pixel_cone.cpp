#include "integrators/pixel_cone.h"

#include <algorithm>
#include <limits>

namespace pileus {

PixelCone pixel_cone(const Camera& camera, const Vec2d& pixel, const Vec2i& picture) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  PixelCone cone{kNever, kNever};
  const Ray here = camera.ray(pixel, picture);
  for (const Vec2d& step : {Vec2d(1, 0), Vec2d(0, 1)}) {
    const Ray beside = camera.ray(pixel + step, picture);
    cone.at_camera = std::min(cone.at_camera, length(beside.o - here.o));
    cone.per_metre = std::min(cone.per_metre, length(beside.d - here.d));
  }
  return cone;
}

PixelCone middle_pixel_cone(const World& world, const Vec2i& picture) {
  if (picture.x <= 0 || picture.y <= 0) return {};
  return pixel_cone(*world.camera, 0.5 * Vec2d(picture), picture);
}

}  // namespace pileus
