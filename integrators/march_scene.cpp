#include "integrators/march_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include <fmt/format.h>

#include "integrators/lighting.h"
#include "integrators/march_places.h"
#include "integrators/phase_table.h"
#include "lib/core/build_features.h"
#include "lib/math/unit_vector.h"
#include "lib/scene/point_source.h"
#include "lib/volume/known_columns.h"
#include "lib/volume/quantized_bricks.h"

namespace pileus {
namespace {

double largest(const Rgb& rgb) {
  return std::max({rgb.x, rgb.y, rgb.z});
}

/// Optical depth of a voxel up to which steps and caches of sunlight find the lit skin of a medium.
constexpr double kDeepestVoxel = 256.0;

double depth_of_voxel(const WorldMedium& medium) {
  return medium.extinction * medium.density->max_density() * medium.density->feature_size();
}

bool is_finite(const Box3d& box) {
  return std::isfinite(length(box.size()));
}

/// The shadows that grids throw are taken to have details as large as a share of the smallest.
double shadow_width(std::span<const WorldMedium* const> media) {
  constexpr double kDetails = 16.0;
  double width = std::numeric_limits<double>::infinity();
  for (const WorldMedium* medium : media) {
    if (!medium->density->has_bricks()) break;
    if (medium->density->bounds().isEmpty()) continue;
    const Vec3d size = medium->density->bounds().size();
    width = std::min({width, size.x / kDetails, size.y / kDetails, size.z / kDetails});
  }
  return std::max(width, std::numeric_limits<double>::min());
}

/// What 16-bit densities change: of optical depths, and of column densities that glow.
struct StorageError {
  double depth, column;
};

/// Errors of neighbouring voxels are like independent ones, uniform within half a step, and add up along a
/// ray as their squares do, three times their mean square at worst; what neighbours have in common
/// (mean_error) adds up itself. Of depths, little is seen behind two.
StorageError storage_error_of(const WorldMedium& medium, double scale, double mean_error, double mean_value) {
  constexpr double kSeenDepth = 2.0, kWorst = 3.0;
  const DensityField& field = *medium.density;
  const double step = scale / std::sqrt(12.0), across = length(field.bounds().size());
  const auto along = [&](double path) {
    return kWorst * step * std::sqrt(path * field.feature_size()) + mean_error * path;
  };
  const double seen = std::min(across, kSeenDepth / std::max(medium.extinction * mean_value, 1e-30));
  return {medium.extinction * along(seen), along(across)};
}

/// Where a lamp lights a medium as it does much of it: in the middle, but not too close to the lamp.
Vec3d typical_point(const WorldMedium& medium, const Light& light) {
  const auto* lamp = dynamic_cast<const PointSource*>(&light);
  const Box3d& bounds = medium.density->bounds();
  if (!lamp || bounds.isEmpty()) return Vec3d(0.0);
  const Vec3d center = bounds.center(), away = center - lamp->position;
  const double least = 0.25 * length(bounds.size());
  return length(away) >= least ? center : lamp->position + least * unit_vector(away).value_or(Vec3d(0, 1, 0));
}

LampPhase lamp_phase(const WorldMedium& medium) {
  LampPhase phase;
  phase.table = phase_table(*medium.phase);
  for (const ScatterTerm& term : medium.scattering) {
    const double flat = phase_weight(term, 0.0), shaped = phase_weight(term, 1.0) - flat;
    phase.flat.push_back(float(flat));
    phase.shaped.push_back(float(shaped));
    if (term.scale > 0.0) phase.flat_sum += flat, phase.shaped_sum += shaped;
  }
  return phase;
}

/// Where the edges of a solid's shadow are not told, they are searched for, step by step from medium to
/// medium: between places that lie far apart they would be overlooked.
bool has_unknown_edges(const World& world) {
  return std::any_of(world.shapes.begin(), world.shapes.end(),
                     [](const auto& shape) { return shape->casts_shadow() && !shape->knows_shadow_edges(); });
}

std::string obstacle_of_places(const World& world, const EffectPlan& plan) {
  const auto stands_in_several = [](const WorldMedium& medium) {
    return medium.density->places().size() > 1;
  };
  const auto found = std::find_if(world.media.begin(), world.media.end(), stands_in_several);
  if (found == world.media.end()) return "";
  const bool has_haze = std::any_of(world.media.begin(), world.media.end(),
                                    [](const WorldMedium& medium) { return !medium.density->has_bricks(); });
  if (has_haze) return "volume \"" + found->name + "\" stands in several places, and some volume is no grid";
  if (plan.scattering && plan.surface_shadows && has_unknown_edges(world))
    return "solids whose shadows have no simple edges, and volume \"" + found->name + "\" in several places";
  return "";
}

/// Lamps light grids that stand but once: hazes need tables of optical depth along rays and places lists of
/// what shades them, which are made for parallel light.
std::string obstacle_of_lamps(const World& world, const EffectPlan& plan) {
  for (const auto& light : world.lights) {
    const bool is_known = light->is_directional() || dynamic_cast<const PointSource*>(light.get());
    if (!is_known) return "a light at a finite distance that does not shine from a point";
  }
  const std::string at = "a light at a finite distance, and ";
  if (plan.aovs.count("error_bound") > 0) return at + "a bound is asked for";
  const bool has_holes = plan.surface_shadows && plan.holes;
  if (has_holes || (plan.surface_shadows && has_unknown_edges(world)))
    return at + "solids whose shadows have no simple edges";
  for (const WorldMedium& medium : world.media) {
    if (!medium.density->has_bricks()) return at + "volume \"" + medium.name + "\", which is not a grid";
    if (medium.density->places().size() > 1) return at + "volume \"" + medium.name + "\" in several places";
  }
  return "";
}

}  // namespace

std::string MarchWorld::obstacle(const World& world, const EffectPlan& plan) {
  if (!plan.media) return "no media to march through";
  const bool wants_bound = plan.aovs.count("error_bound") > 0;
  for (const WorldMedium& medium : world.media) {
    if (medium.density->has_bricks()) {
      if (!wants_bound && depth_of_voxel(medium) > kDeepestVoxel)
        return "light ends within a small part of a voxel of volume \"" + medium.name + "\"";
      continue;
    }
    if (wants_bound && !dynamic_cast<const KnownColumns*>(medium.density.get()))
      return "no bound is known for volume \"" + medium.name +
             "\", neither a grid nor a haze of known shadow";
    if (!is_finite(medium.density->bounds())) return "volume \"" + medium.name + "\" has no end";
  }
  if (plan.scattering && plan.local_lights) {
    if (const std::string why = obstacle_of_lamps(world, plan); !why.empty()) return why;
  }
  if (const std::string why = obstacle_of_places(world, plan); !why.empty()) return why;
  return "";
}

MarchWorld::MarchWorld(const World& world, const EffectPlan& plan, const MarchStorage& storage)
    : m_world(world) {
  for (const WorldMedium& medium : world.media) m_media.push_back(&medium);
  std::stable_partition(m_media.begin(), m_media.end(),
                        [](const WorldMedium* medium) { return medium->density->has_bricks(); });
  if (plan.scattering) add_lights();
  for (const WorldMedium* medium : m_media) {
    if (medium->density->has_bricks()) {
      add_grid(*medium, storage);
    } else {
      add_medium(*medium, kernel.hazes.emplace_back());
    }
  }
  std::vector<std::vector<Affine>> places;
  for (size_t g = 0; g < kernel.grids.size(); ++g) places.push_back(local_places(g));
  add_places(places, kernel);
  if (has_lamps()) {
    for (const WorldMedium* medium : m_media) kernel.lamp_phases.push_back(lamp_phase(*medium));
  }
  m_base_height = m_media.front()->density->bounds().min.y;
  kernel.shadow_width = shadow_width(m_media);
}

/// Light that a medium scatters towards the camera, in the middle and at the corners of the picture; at least
/// white.
double MarchWorld::brightness_in_view(const WorldMedium& medium) const {
  double most = 1.0;
  for (int n = 0; n < 5; ++n) {
    const Vec2d pixel = n == 4 ? Vec2d(1.0) : Vec2d(2.0 * (n & 1), 2.0 * (n >> 1));
    const Vec3d direction = m_world.camera->ray(pixel, Vec2i(2)).d;
    double sum = 0.0;
    for (const auto& light : m_world.lights) {
      const Illumination sun = light->at(typical_point(medium, *light));
      const double p = medium.phase->p(-direction, sun.wi),
                   strength = largest(medium.albedo * sun.irradiance);
      for (const ScatterTerm& term : medium.scattering) sum += phase_weight(term, p) * strength;
    }
    most = std::max(most, sum);
  }
  return most;
}

std::shared_ptr<const BrickPyramid> MarchWorld::stored_values(const WorldMedium& medium,
                                                              const MarchStorage& storage) {
  const auto take_floats = [&](const std::string& why) {
    m_storage_choices.push_back(fmt::format("values of {} as floats: {}", medium.name, why));
    return std::make_shared<const BrickPyramid>(*medium.density->bricks());
  };
  if (storage.kind == MarchStorage::Kind::floats) return take_floats(storage.why_floats);
  const double scale = quantization_scale(float(medium.density->max_density()));
  if (!(scale > 0.0)) return take_floats("among the smallest or largest of all");
  const double brightness = brightness_in_view(medium), glow = largest(medium.emission);
  const auto shown = [&](const StorageError& error) {
    return brightness * error.depth + glow * error.column;
  };
  const auto is_too_large = [&](const StorageError& error) {
    return storage.kind == MarchStorage::Kind::by_error && !(shown(error) <= storage.allowed);
  };
  const auto refuse = [&](const StorageError& error) {
    return take_floats(
        fmt::format("16 bits would err by {:.2g}, of {:.2g} allowed", shown(error), storage.allowed));
  };
  const StorageError least = storage_error_of(medium, scale, 0.0, medium.density->max_density());
  if (is_too_large(least)) return refuse(least);
  auto pyramid = medium.density->quantized_bricks();
  const QuantizedValues& values = *pyramid->quantized();
  const StorageError error = storage_error_of(medium, scale, values.mean_error, values.mean_value);
  if (is_too_large(error)) return refuse(error);
  m_storage_depth_error += error.depth;
  m_storage_glow_error += glow * error.column;
  m_storage_error_in_view += shown(error);
  m_storage_choices.push_back(fmt::format("values of {} in 16 bits, {:.1f} MB: estimated error {:.2g}",
                                          medium.name, 1e-6 * double(pyramid->bytes_of_values()),
                                          shown(error)));
  return pyramid;
}

void MarchWorld::add_grid(const WorldMedium& medium, const MarchStorage& storage) {
  m_levels.push_back({0, nullptr, stored_values(medium, storage)});
  add_medium(medium, kernel.grids.emplace_back());
  place_grid(kernel.grids.size() - 1);
}

void MarchWorld::add_medium(const WorldMedium& medium, MarchMedium& kernel_medium) {
  kernel_medium.extinction = medium.extinction;
  kernel_medium.terms = int(medium.scattering.size());
  for (size_t k = 0; k < medium.scattering.size(); ++k)
    kernel_medium.term_extinction[k] = float(medium.scattering[k].extinction);
  add_glow(medium, kernel_medium);
  kernel.several_terms |= kernel_medium.terms > 1;
  kernel.height_light |= medium.ambient.top != medium.ambient.bottom;
  m_is_isotropic &= medium.phase->is_isotropic();
  m_densest += medium.extinction * medium.density->max_density();
}

/// Makes the kernel read the grid at its present level.
void MarchWorld::place_grid(size_t index) {
  MarchGrid& grid = kernel.grids[index];
  grid.pyramid = m_levels[index].pyramid.get();
  const Vec3d origin(grid.pyramid->origin());
  grid.local_from_world = local_places(index).front();
  grid.bounds = Box3d(Vec3d(grid.pyramid->lo()) - origin, Vec3d(grid.pyramid->hi()) - origin);
}

/// The kernel's space of a grid from the world, for each place in which it stands.
std::vector<Affine> MarchWorld::local_places(size_t index) const {
  const GridLevel& level = m_levels[index];
  const Affine local_from_index = Affine::translation(-Vec3d(level.pyramid->origin())) *
                                  Affine::scaling(Vec3d(std::ldexp(1.0, -level.level)));
  std::vector<Affine> places;
  for (const Affine& index_from_world : m_media[index]->density->places())
    places.push_back(local_from_index * index_from_world);
  return places;
}

std::optional<MarchWorld::GridLevel> MarchWorld::coarser_level(size_t grid) const {
  const BrickPyramid& present = *kernel.grids[grid].pyramid;
  std::optional<BrickGrid> coarser =
      coarsen(present.quantized() ? *m_media[grid]->density->bricks() : present.grid());
  if (!coarser) return std::nullopt;
  GridLevel next;
  next.level = level(grid) + 1;
  next.coarse = std::make_unique<BrickGrid>(std::move(*coarser));
  next.pyramid = std::make_shared<const BrickPyramid>(*next.coarse);
  return next;
}

MarchWorld::GridLevel MarchWorld::exchange_level(size_t grid, GridLevel next) {
  std::swap(m_levels[grid], next);
  place_grid(grid);
  return next;
}

void MarchWorld::add_lights() {
  kernel.lights = int(m_world.lights.size());
  for (size_t l = 0; l < m_world.lights.size(); ++l) {
    m_suns.push_back(m_world.lights[l]->at(Vec3d(0.0)));
    kernel.towards_suns.push_back(m_suns.back().wi);
    if (!m_world.lights[l]->is_directional()) add_lamp(l);
  }
  kernel.enough_shadow = 40.0 / slowest_extinction(m_world);
  for (const WorldMedium* medium : m_media) {
    for (const Illumination& sun : m_suns) {
      const Rgb colour = medium->albedo * sun.irradiance;
      const double strength = largest(colour);
      m_strengths.push_back(strength);
      m_colours.push_back(strength > 0.0 ? colour / strength : Rgb(0.0));
    }
  }
}

void MarchWorld::add_lamp(size_t light) {
  const auto& source = dynamic_cast<const PointSource&>(*m_world.lights[light]);
  MarchLamp& lamp = kernel.lamps.emplace_back();
  lamp.light = int(light);
  lamp.position = source.position;
  lamp.radius = source.radius;
  for (const WorldMedium* medium : m_media)
    lamp.strengths.push_back(float(largest(medium->albedo * source.intensity)));
  m_suns.back().irradiance = source.intensity;
}

/// Emission and the light of the sky: both are in proportion to the density.
void MarchWorld::add_glow(const WorldMedium& medium, MarchMedium& of) const {
  const double emission = largest(medium.emission),
               sky = std::max(largest(medium.albedo * medium.ambient.top),
                              largest(medium.albedo * medium.ambient.bottom));
  of.glow = emission + medium.extinction * sky;
  const double deepest = medium.density->max_density() * length(medium.density->bounds().size());
  of.glow_bound = sky + std::min(emission / medium.extinction, emission * deepest);
  if (emission == 0.0) of.glow_bound = sky;
}

double MarchWorld::sunlit(size_t medium, const float* weights) const {
  double sum = 0.0;
  for (size_t l = 0; l < m_suns.size(); ++l) {
    const float* of_light = weights + (medium * m_suns.size() + l) * kMostTerms;
    for (int k = 0; k < kernel.medium(medium).terms; ++k) sum += std::max(0.0, double(of_light[k]));
  }
  return sum;
}

double MarchWorld::sunlit(const float* weights) const {
  double most = 0.0;
  for (size_t m = 0; m < kernel.media(); ++m) most = std::max(most, sunlit(m, weights));
  return most;
}

double MarchWorld::brightest(const float* weights) const {
  double most = 0.0;
  for (size_t m = 0; m < kernel.media(); ++m)
    most = std::max(most, kernel.medium(m).glow_bound + sunlit(m, weights));
  return most;
}

void MarchWorld::weights_for(const Vec3d& direction, std::vector<float>& weights) const {
  weights.assign(kernel.media() * m_suns.size() * kMostTerms, 0.0f);
  for (size_t m = 0; m < kernel.media(); ++m) {
    const WorldMedium& medium = *m_media[m];
    for (size_t l = 0; l < m_suns.size(); ++l) {
      const size_t at = m * m_suns.size() + l;
      if (!m_world.lights[l]->is_directional()) continue;
      const double p = medium.phase->p(-direction, m_suns[l].wi);
      for (size_t k = 0; k < medium.scattering.size(); ++k) {
        weights[at * kMostTerms + k] = float(phase_weight(medium.scattering[k], p) * m_strengths[at]);
      }
    }
  }
}

void MarchWorld::set_lamp_weights(const Vec3d& direction, const Vec3d& p_world,
                                  std::vector<float>& weights) const {
  for (const MarchLamp& lamp : kernel.lamps) {
    const Vec3d to_lamp = lamp.position - p_world;
    const double r = std::max(length(to_lamp), lamp.radius);
    const Vec3d wi = unit_vector(to_lamp).value_or(Vec3d(0.0, 1.0, 0.0));
    for (size_t m = 0; m < kernel.media(); ++m) {
      const LampPhase& phase = kernel.lamp_phases[m];
      const double p = phase_at(phase.table, phase_coordinate(-direction, wi)),
                   light = double(lamp.strengths[m]) / (r * r);
      float* const of = weights.data() + (m * m_suns.size() + size_t(lamp.light)) * kMostTerms;
      for (size_t k = 0; k < phase.flat.size(); ++k)
        of[k] = float(light * (double(phase.flat[k]) + double(phase.shaped[k]) * p));
    }
  }
}

LampLight MarchWorld::lamplight(const Ray& ray, const Segment& segment) const {
  constexpr double kRoundings = 8.0 * std::numeric_limits<float>::epsilon();
  LampLight light;
  const Segment inside = media_range(m_world, ray, segment);
  if (inside.empty()) return light;
  for (const MarchLamp& lamp : kernel.lamps) {
    const double closest = std::clamp(dot(lamp.position - ray.o, ray.d), inside.t0, inside.t1);
    const double r = std::max(length(lamp.position - ray.at(closest)), lamp.radius);
    double brightest = 0.0;
    for (size_t m = 0; m < kernel.media(); ++m) {
      const LampPhase& phase = kernel.lamp_phases[m];
      const auto s_at = [&](double t) {
        return phase_coordinate(-ray.d, unit_vector(lamp.position - ray.at(t)).value_or(ray.d));
      };
      const double p = phase.table.between(s_at(inside.t0), s_at(inside.t1)).most;
      brightest = std::max(brightest, double(lamp.strengths[m]) / (r * r) * phase.most(p));
    }
    light.brightest += brightest;
    // As bright as that it is over a length like r.
    const double of_ray = brightest * std::min(1.0, m_densest * std::numbers::pi * r);
    light.rounding += of_ray * (kRoundings * inside.length() / r + worst_phase_error());
  }
  return light;
}

/// Of the tables, relative.
double MarchWorld::worst_phase_error() const {
  double worst = 0.0;
  for (const LampPhase& phase : kernel.lamp_phases) worst = std::max(worst, phase.table.error);
  return worst;
}

void MarchWorld::set_height(const Ray& ray, MarchRay& job) const {
  job.height0 = ray.o.y - m_base_height;
  job.height1 = ray.d.y;
}

double MarchWorld::light(const double* sums) const {
  double light = 0.0;
  for (size_t m = 0; m < kernel.media(); ++m, sums += sums_per_medium(kernel)) {
    for (size_t l = 0; l < m_suns.size(); ++l) light += std::abs(sums[2 + l]);
  }
  return light;
}

Rgb MarchWorld::radiance(const double* sums) const {
  Rgb radiance(0.0);
  const size_t stride = sums_per_medium(kernel), lights = m_suns.size();
  for (size_t m = 0; m < kernel.media(); ++m, sums += stride) {
    const WorldMedium& medium = *m_media[m];
    if constexpr (kHasEmission) radiance += medium.emission * sums[0];
    for (size_t l = 0; l < lights; ++l) radiance += m_colours[m * lights + l] * sums[2 + l];
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
  const Illumination way = light_at(light, p_world);
  double tau = 0.0;
  for (const WorldMedium* grid : std::span(m_media).first(kernel.grids.size())) {
    if (!(grid->extinction > 0.0)) continue;
    tau += grid->extinction * grid->density->column({p_world, way.wi}, {0.0, way.distance}, kAll, counters);
  }
  return tau;
}

}  // namespace pileus
