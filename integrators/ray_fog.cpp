#include "integrators/ray_fog.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace pileus {

FogSetup::FogSetup(const World& all, double tolerance, const Vec2i& picture)
    : world(all), accuracy(std::max(1e-3 * tolerance, 1e-11)) {
  if (world.fogs.size() != 1) return;
  const WorldFog& fog = world.fogs.front();
  const auto* fading = dynamic_cast<const FadingFog*>(fog.model.get());
  if (!fading) return;
  alone = &fading->fading;
  const bool has_picture = picture.x > 0 && picture.y > 0;
  if (alone->per == Fading::Per::vertex && has_picture)
    corners = std::make_unique<const FogCorners>(world, *alone, fog.view, picture);
}

std::string FogSetup::choice() const {
  if (corners)
    return fmt::format("fog: by its law at the corners of tiles of {} pixels, bilinear between them",
                       Fading::kTile);
  if (alone && alone->per == Fading::Per::table)
    return fmt::format("fog: from a table of {} distances", Fading::kEntries);
  return "";
}

void RayFog::build(const Ray& ray, double t_end, bool is_from_camera) {
  m_is_from_camera = is_from_camera;
  m_ray = ray;
  m_end = t_end;
  if (m_setup.alone) return;
  std::vector<FogPiece>& pieces = m_fog.start();
  for (const WorldFog& fog : m_setup.world.fogs) fog.model->append_pieces(ray, fog.view, pieces);
  m_fog.finish(t_end, m_setup.accuracy);
}

double RayFog::tau_to(double t) const {
  return m_setup.alone ? -std::log(m_setup.alone->shown(distance(t))) : m_fog.tau_to(t);
}

FogRange RayFog::between(double t0, double t1) const {
  if (!m_setup.alone) return m_fog.between(t0, t1);
  const Fading& fading = *m_setup.alone;
  const double depth0 = tau_to(t0), depth1 = tau_to(t1);
  // By its law the depth is convex; from a table it still grows.
  double bend = depth1 - depth0;
  if (fading.per != Fading::Per::table)
    bend = 2.0 * std::abs(tau_to(0.5 * (t0 + t1)) - 0.5 * (depth0 + depth1));
  if (!std::isfinite(depth1)) bend = std::numeric_limits<double>::infinity();
  return {bend, fading.colour, fading.colour};
}

LightGrowth RayFog::growth(double t0, double t1) const {
  if (!m_setup.alone) return m_fog.growth(t0, t1);
  const Rgb grown = to(t1).light - to(t0).light;
  return {grown, grown};
}

std::vector<double> RayFog::edges() const {
  if (!m_setup.alone) return m_fog.edges();
  const double per_metre = distance(1.0);
  std::vector<double> edges{m_setup.alone->start / per_metre, m_setup.alone->end / per_metre};
  std::erase_if(edges, [](double t) { return !(t > 0.0 && std::isfinite(t)); });
  return edges;
}

}  // namespace pileus
