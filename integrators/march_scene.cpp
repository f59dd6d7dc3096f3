#include "integrators/march_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "integrators/lighting.h"
#include "lib/math/box.h"

namespace pileus {
namespace {

double largest(const Rgb& rgb) {
  return std::max({rgb.x, rgb.y, rgb.z});
}

}  // namespace

std::string MarchWorld::obstacle(const World& world, const EffectPlan& plan) {
  if (!plan.media) return "no media to march through";
  for (const WorldMedium& medium : world.media) {
    if (!medium.density->bricks()) return "volume \"" + medium.name + "\" is not a grid";
  }
  if (plan.scattering && plan.local_lights) return "a light at a finite distance";
  if (plan.scattering && plan.surface_shadows) return "solids cast shadows into media";
  return "";
}

MarchWorld::MarchWorld(const World& world, const EffectPlan& plan) : m_world(world) {
  for (const WorldMedium& medium : world.media) add_grid(medium);
  m_base_height = world.media.front().density->bounds().min.y;
  if (plan.scattering) add_suns();
  bound_brightness();
}

void MarchWorld::add_grid(const WorldMedium& medium) {
  m_pyramids.push_back(std::make_unique<BrickPyramid>(*medium.density->bricks()));
  MarchGrid grid;
  grid.pyramid = m_pyramids.back().get();
  const BrickGrid& bricks = grid.pyramid->grid();
  const Vec3d origin(grid.pyramid->origin());
  grid.local_from_world = Affine::translation(-origin) * medium.density->index_from_world();
  grid.bounds = Box3d(Vec3d(bricks.lo()) - origin, Vec3d(bricks.hi()) - origin);
  grid.extinction = medium.extinction;
  grid.terms = int(medium.scattering.size());
  for (size_t k = 0; k < medium.scattering.size(); ++k) {
    grid.term_extinction[k] = float(medium.scattering[k].extinction);
  }
  kernel.several_terms |= grid.terms > 1;
  kernel.height_light |= medium.ambient.top != medium.ambient.bottom;
  kernel.grids.push_back(grid);
  m_is_isotropic &= medium.phase->is_isotropic();
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

/// For phase functions the forward and the isotropic value bound what steps are chosen by: a tuning matter,
/// no promise.
void MarchWorld::bound_brightness() {
  for (size_t g = 0; g < m_world.media.size(); ++g) {
    const WorldMedium& medium = m_world.media[g];
    double sum =
        std::max(largest(medium.albedo * medium.ambient.top), largest(medium.albedo * medium.ambient.bottom));
    const double side = medium.phase->p(Vec3d(1, 0, 0), Vec3d(0, 1, 0));
    for (size_t l = 0; l < m_suns.size(); ++l) {
      sum += m_strengths[g * m_suns.size() + l] * scatter_response_bound(medium.scattering, side);
    }
    if (medium.extinction > 0.0) sum += largest(medium.emission) / medium.extinction;
    m_brightest = std::max(m_brightest, sum);
  }
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
    radiance += medium.emission * sums[0];
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

double MarchWorld::stepped_depth(size_t light, const Vec3d& p_world, double step) const {
  double tau = 0.0;
  std::vector<double> rho;
  FieldCounters counters;
  for (const WorldMedium& medium : m_world.media) {
    if (!(medium.extinction > 0.0)) continue;
    const Ray ray{p_world, m_suns[light].wi};
    const double dt = step / length(medium.density->index_from_world().direction(ray.d));
    const Segment inside =
        clip_to_box(ray, {0.0, std::numeric_limits<double>::infinity()}, medium.density->bounds());
    if (inside.empty()) continue;
    rho.resize(size_t(inside.t1 / dt) + 1);
    medium.density->sample(ray, 0.5 * dt, dt, rho, counters);
    tau += medium.extinction * dt * std::accumulate(rho.begin(), rho.end(), 0.0);
  }
  return tau;
}

}  // namespace pileus
