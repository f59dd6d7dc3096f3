#include "lib/cloud/procedural_cloud.h"

#include <algorithm>
#include <cmath>

namespace pileus {

namespace {

FbmParams fitted_noise(const CloudRecipe& recipe, const Box3d& bounds) {
  FbmParams noise = recipe.noise;
  if (noise.frequency == 0.0) noise.frequency = CloudRecipe::kAutomaticCells / bounds.size().y;
  return noise;
}

double smoothstep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

/// The piecewise linear function through the points, constant beyond the first and the last.
double interpolate(const std::vector<Vec2d>& points, double x) {
  const auto after = std::upper_bound(points.begin(), points.end(), x,
                                      [](double value, const Vec2d& point) { return value < point.x; });
  if (after == points.begin()) return points.front().y;
  if (after == points.end()) return points.back().y;
  const Vec2d &a = *(after - 1), &b = *after;
  return a.y + (b.y - a.y) * ((x - a.x) / (b.x - a.x));
}

}  // namespace

ProceduralCloud::ProceduralCloud(const CloudRecipe& recipe, const FreeForm& form)
    : m_recipe(recipe), m_form(form), m_bounds(form.bounds()), m_billows(fitted_noise(recipe, m_bounds)) {}

double ProceduralCloud::density(const Vec3d& p_world) const {
  const double f = m_form.value(p_world);
  if (!(f > 0)) return 0;  // also where a coordinate is not finite
  const double cover = coverage(f, height_factor(p_world.y));
  if (cover <= m_recipe.threshold) return 0;  // noise only takes away
  const double valley = 1 - std::min(1.0, m_billows.value(OctaveSum::billow, p_world));
  return remapped(cover - m_recipe.erosion * valley * valley);
}

bool ProceduralCloud::is_empty(const Box3d& box_world) const {
  const double f = m_form.upper_bound(box_world);
  return !(f > 0) || coverage(f, 1) <= m_recipe.threshold;
}

double ProceduralCloud::height_factor(double y_world) const {
  const double height = (y_world - m_bounds.min.y) / (m_bounds.max.y - m_bounds.min.y);
  return interpolate(m_recipe.height_profile, height);
}

double ProceduralCloud::coverage(double f, double factor) const {
  const double depth = 1 - std::sqrt(std::max(0.0, 1 - f));
  return factor * smoothstep(depth / m_recipe.edge);
}

double ProceduralCloud::remapped(double carved) const {
  const double theta = m_recipe.threshold;
  return std::min(1.0, m_recipe.sharpness * std::max(0.0, (carved - theta) / (1 - theta)));
}

}  // namespace pileus
