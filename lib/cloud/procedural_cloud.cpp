#include "lib/cloud/procedural_cloud.h"

#include <utility>

#include "lib/cloud/cloud_region.h"

namespace pileus {

namespace {

double frequency_of(const CloudNoiseRecipe& recipe, const CloudBody& form) {
  return recipe.frequency > 0 ? recipe.frequency : recipe.cells / form.bounds().size().y;
}

std::optional<CloudNoise> detail_noise(const CloudRecipe& recipe, const CloudBody& form) {
  if (recipe.detail_erosion == 0) return std::nullopt;
  return CloudNoise(recipe.detail, frequency_of(recipe.detail, form));
}

std::shared_ptr<const PictureMap> picture_map(const PictureMapRecipe& recipe, const Box3d& box) {
  return recipe.is_used() ? std::make_shared<const PictureMap>(recipe, box) : nullptr;
}

}  // namespace

ProceduralCloud::ProceduralCloud(const CloudRecipe& recipe, const CloudBody& form, DensityMap map)
    : m_recipe(recipe),
      m_shape(recipe, form),
      m_formula(recipe),
      m_height_profile(recipe.height_profile),
      m_density_profile(recipe.density_profile),
      m_noise(recipe.noise, frequency_of(recipe.noise, form)),
      m_detail(detail_noise(recipe, form)),
      m_coverage_map(picture_map(recipe.coverage_map, m_shape.bounds())),
      m_texture(picture_map(recipe.texture, m_shape.bounds())),
      m_density_map(std::move(map)) {}

double ProceduralCloud::density(const Vec3d& p_world, double width) const {
  const double f = m_shape.form().value(m_shape.form_point(p_world));
  if (!(f > 0)) return 0;  // also where a coordinate is not finite
  const double height = m_shape.relative_height(p_world.y);
  double coverage = m_formula.coverage(f) * m_height_profile.value(height);
  if (m_coverage_map) coverage *= m_coverage_map->value(p_world);
  if (coverage <= m_recipe.threshold) return 0;  // noise only takes away
  double rho = m_formula.density(frayed(coverage, p_world)) * m_density_profile.value(height);
  if (m_texture) rho *= m_texture->value(p_world);
  if (m_density_map && rho > 0) rho *= m_density_map(p_world, width);
  return rho;
}

double ProceduralCloud::noise_frequency() const {
  return frequency_of(m_recipe.noise, m_shape.form());
}

double ProceduralCloud::frayed(double coverage, const Vec3d& p_world) const {
  const double carved = m_formula.carved(coverage, m_noise.value(p_world));
  return m_detail ? m_formula.frayed(carved, m_detail->value(p_world)) : carved;
}

Interval ProceduralCloud::range(const Box3d& box_world) const {
  return CloudRegion(*this, box_world).range();
}

}  // namespace pileus
