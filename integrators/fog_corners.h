#pragma once

#include <vector>

#include "lib/fog/fading.h"
#include "lib/scene/world.h"

namespace pileus {

/// How much of the ends of camera rays shows through a fog, at the corners of square tiles of a picture;
/// between them it is bilinear. Wrong where a tile shows things at different distances: the least accurate of
/// the ways.
class FogCorners {
 public:
  /// Traces a ray per corner to what it meets. picture: its size [pixels], > 0
  FogCorners(const World& world, const Fading& fading, const FogView& view, const Vec2i& picture);

  /// Of a ray of the camera.
  double shown(const Ray& ray) const;

 private:
  double at(int x, int y) const { return m_shown[size_t(y) * size_t(m_across) + size_t(x)]; }

  Imath::M44d m_screen_from_world;
  Vec2d m_tiles_per_screen;  ///< of the picture, along x and y
  int m_across = 0, m_down = 0;
  std::vector<double> m_shown;  ///< [y][x], corners
};

}  // namespace pileus
