#include "integrators/fog_corners.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/core/parallel.h"

namespace pileus {

FogCorners::FogCorners(const World& world, const Fading& fading, const FogView& view, const Vec2i& picture)
    : m_screen_from_world(world.camera->screen_from_world(picture)),
      m_tiles_per_screen(double(picture.x) / Fading::kTile, double(picture.y) / Fading::kTile),
      m_across(int(std::ceil(m_tiles_per_screen.x)) + 1),
      m_down(int(std::ceil(m_tiles_per_screen.y)) + 1),
      m_shown(size_t(m_across) * size_t(m_down)) {
  parallel_for(size_t(m_down), [&](size_t y) {
    for (int x = 0; x < m_across; ++x) {
      const Ray ray = world.camera->ray(Vec2d(x, double(y)) * double(Fading::kTile), picture);
      const auto hit = nearest_surface(world, ray, {0.0, std::numeric_limits<double>::infinity()});
      m_shown[y * size_t(m_across) + size_t(x)] = fading.fade(
          fading.distance(hit ? hit->t : std::numeric_limits<double>::infinity(), ray.d, view.axis));
    }
  });
}

double FogCorners::shown(const Ray& ray) const {
  Vec3d on_screen;
  m_screen_from_world.multVecMatrix(ray.at(1.0), on_screen);
  const auto tile = [](double share, double tiles, int corners, int& index) {
    const double at = std::clamp(share * tiles, 0.0, double(corners - 1));
    index = std::min(int(at), corners - 2);
    return at - index;
  };
  int x = 0, y = 0;
  const double u = tile(0.5 + 0.5 * on_screen.x, m_tiles_per_screen.x, m_across, x),
               v = tile(0.5 - 0.5 * on_screen.y, m_tiles_per_screen.y, m_down, y);
  const double above = at(x, y) + u * (at(x + 1, y) - at(x, y)),
               below = at(x, y + 1) + u * (at(x + 1, y + 1) - at(x, y + 1));
  return above + v * (below - above);
}

}  // namespace pileus
