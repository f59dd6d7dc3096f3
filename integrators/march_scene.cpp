#include "integrators/march_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "integrators/lighting.h"
#include "lib/core/build_features.h"

namespace pileus {
namespace {

double largest(const Rgb& rgb) {
  return std::max({rgb.x, rgb.y, rgb.z});
}

bool solids_shadow_media(const World& world) {
  for (const auto& light : world.lights) {
    const Vec3d towards_sun = light->at(Vec3d(0.0)).wi;
    for (const auto& shape : world.shapes) {
      for (const WorldMedium& medium : world.media) {
        if (shape->may_shadow(medium.density->bounds(), towards_sun)) return true;
      }
    }
  }
  return false;
}

}  // namespace

std::string MarchWorld::obstacle(const World& world, const EffectPlan& plan) {
  if (!plan.media) return "no media to march through";
  for (const WorldMedium& medium : world.media) {
    if (!medium.density->bricks()) return "volume \"" + medium.name + "\" is not a grid";
  }
  if (plan.scattering && plan.local_lights) return "a light at a finite distance";
  if (plan.scattering && solids_shadow_media(world)) return "solids cast shadows into media";
  return "";
}

MarchWorld::MarchWorld(const World& world, const EffectPlan& plan) : m_world(world) {
  for (const WorldMedium& medium : world.media) add_grid(medium);
  m_base_height = world.media.front().density->bounds().min.y;
  if (plan.scattering) add_suns();
}

void MarchWorld::add_grid(const WorldMedium& medium) {
  m_levels.push_back({0, nullptr, std::make_unique<BrickPyramid>(*medium.density->bricks())});
  MarchGrid grid;
  grid.extinction = medium.extinction;
  grid.terms = int(medium.scattering.size());
  for (size_t k = 0; k < medium.scattering.size(); ++k) {
    grid.term_extinction[k] = float(medium.scattering[k].extinction);
  }
  kernel.several_terms |= grid.terms > 1;
  kernel.height_light |= medium.ambient.top != medium.ambient.bottom;
  add_glow(medium, grid);
  kernel.grids.push_back(grid);
  place_grid(kernel.grids.size() - 1);
  m_is_isotropic &= medium.phase->is_isotropic();
}

/// Makes the kernel read the grid at its present level.
void MarchWorld::place_grid(size_t index) {
  MarchGrid& grid = kernel.grids[index];
  grid.pyramid = m_levels[index].pyramid.get();
  const BrickGrid& bricks = grid.pyramid->grid();
  const Vec3d origin(grid.pyramid->origin());
  const double scale = std::ldexp(1.0, -m_levels[index].level);
  grid.local_from_world = Affine::translation(-origin) * Affine::scaling(Vec3d(scale)) *
                          m_world.media[index].density->index_from_world();
  grid.bounds = Box3d(Vec3d(bricks.lo()) - origin, Vec3d(bricks.hi()) - origin);
}

std::optional<MarchWorld::GridLevel> MarchWorld::coarser_level(size_t grid) const {
  std::optional<BrickGrid> coarser = coarsen(kernel.grids[grid].pyramid->grid());
  if (!coarser) return std::nullopt;
  GridLevel next;
  next.level = level(grid) + 1;
  next.coarse = std::make_unique<BrickGrid>(std::move(*coarser));
  next.pyramid = std::make_unique<BrickPyramid>(*next.coarse);
  return next;
}

MarchWorld::GridLevel MarchWorld::exchange_level(size_t grid, GridLevel next) {
  std::swap(m_levels[grid], next);
  place_grid(grid);
  return next;
}

void MarchWorld::add_suns() {
  kernel.lights = int(m_world.lights.size());
  for (const auto& light : m_world.lights) {
    m_suns.push_back(light->at(Vec3d(0.0)));
    kernel.towards_suns.push_back(m_suns.back().wi);
  }
  kernel.enough_shadow = 40.0 / slowest_extinction(m_world);
  for (const WorldMedium& medium : m_world.media) {
    for (const Illumination& sun : m_suns) {
      const Rgb colour = medium.albedo * sun.irradiance;
      const double strength = largest(colour);
      m_strengths.push_back(strength);
      m_colours.push_back(strength > 0.0 ? colour / strength : Rgb(0.0));
    }
  }
}

/// Emission and the light of the sky: both are in proportion to the density.
void MarchWorld::add_glow(const WorldMedium& medium, MarchGrid& grid) const {
  const double emission = largest(medium.emission),
               sky = std::max(largest(medium.albedo * medium.ambient.top),
                              largest(medium.albedo * medium.ambient.bottom));
  grid.glow = emission + medium.extinction * sky;
  const double deepest = medium.density->max_density() * length(medium.density->bounds().size());
  grid.glow_bound = sky + std::min(emission / medium.extinction, emission * deepest);
  if (emission == 0.0) grid.glow_bound = sky;
}

double MarchWorld::brightest(const float* weights) const {
  double most = 0.0;
  for (size_t g = 0; g < kernel.grids.size(); ++g) {
    double sum = kernel.grids[g].glow_bound;
    for (size_t l = 0; l < m_suns.size(); ++l) {
      const float* of_light = weights + (g * m_suns.size() + l) * kMostTerms;
      for (int k = 0; k < kernel.grids[g].terms; ++k) sum += std::max(0.0, double(of_light[k]));
    }
    most = std::max(most, sum);
  }
  return most;
}

void MarchWorld::weights_for(const Vec3d& direction, std::vector<float>& weights) const {
  weights.resize(kernel.grids.size() * m_suns.size() * kMostTerms);
  for (size_t g = 0; g < kernel.grids.size(); ++g) {
    const WorldMedium& medium = m_world.media[g];
    for (size_t l = 0; l < m_suns.size(); ++l) {
      const size_t at = g * m_suns.size() + l;
      const double p = medium.phase->p(-direction, m_suns[l].wi);
      for (size_t k = 0; k < medium.scattering.size(); ++k) {
        weights[at * kMostTerms + k] = float(phase_weight(medium.scattering[k], p) * m_strengths[at]);
      }
    }
  }
}

void MarchWorld::set_height(const Ray& ray, MarchRay& job) const {
  job.height0 = ray.o.y - m_base_height;
  job.height1 = ray.d.y;
}

Rgb MarchWorld::radiance(const double* sums) const {
  Rgb radiance(0.0);
  const size_t stride = sums_per_grid(kernel), lights = m_suns.size();
  for (size_t g = 0; g < kernel.grids.size(); ++g, sums += stride) {
    const WorldMedium& medium = m_world.media[g];
    if constexpr (kHasEmission) radiance += medium.emission * sums[0];
    for (size_t l = 0; l < lights; ++l) radiance += m_colours[g * lights + l] * sums[2 + l];
    const AmbientLight& sky = medium.ambient;
    if (!sky.is_on()) continue;
    const double scattered = medium.extinction * sums[0];
    const double heights = sums[1] + (m_base_height - sky.y0) * scattered;
    const Rgb slope = kernel.height_light ? (sky.top - sky.bottom) / (sky.y1 - sky.y0) : Rgb(0.0);
    radiance += medium.albedo * (sky.bottom * scattered + slope * heights);
  }
  return radiance;
}

double MarchWorld::exact_depth(size_t light, const Vec3d& p_world, FieldCounters& counters) const {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  double tau = 0.0;
  for (const WorldMedium& medium : m_world.media) {
    if (!(medium.extinction > 0.0)) continue;
    tau +=
        medium.extinction * medium.density->column({p_world, m_suns[light].wi}, {0.0, kAll}, kAll, counters);
  }
  return tau;
}

}  // namespace pileus
