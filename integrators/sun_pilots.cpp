#include "integrators/sun_pilots.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "integrators/kernels/sun_kernel.h"
#include "integrators/march_places.h"
#include "integrators/pilot_pixels.h"
#include "lib/core/parallel.h"
#include "lib/math/box.h"
#include "lib/math/transmittance.h"

namespace pileus {
namespace {

constexpr size_t kFirstPilots = 336;  ///< pilot rays all over the picture, at first
constexpr size_t kEnoughPilots = 64;  ///< that meet a medium
constexpr double kPilotStep = 0.5;    ///< of the columns that count as true [cells]
constexpr double kFinePilotStep = 0.125;

/// Extinctions at equal steps along a ray.
struct RayProfile {
  double t0 = 0.0, dt = 0.0;
  std::vector<float> sigma;  ///< [1/m]
};

void add_haze(const WorldMedium& haze, const Ray& ray, RayProfile& profile) {
  std::vector<double> rho(profile.sigma.size());
  FieldCounters counters;
  haze.density->sample(ray, profile.t0, profile.dt, rho, counters);
  for (size_t i = 0; i < rho.size(); ++i) profile.sigma[i] += float(haze.extinction * rho[i]);
}

void add_grid(const GridOnRay& on, RayProfile& profile) {
  const double last = double(profile.sigma.size() - 1);
  const auto step_at = [&](double t) { return std::clamp((t - profile.t0) / profile.dt, 0.0, last); };
  const size_t first = size_t(step_at(on.inside.t0)), end = size_t(std::ceil(step_at(on.inside.t1))) + 1;
  std::vector<float> rho(end - first);
  sample_density(on.grid, on.local, profile.t0 + double(first) * profile.dt, profile.dt, rho);
  for (size_t i = first; i < end; ++i) profile.sigma[i] += float(on.grid.extinction) * rho[i - first];
}

/// Through all media of a world that has grids, a cell at a time unless that were very many.
RayProfile profile_of(const MarchWorld& march, const Ray& ray) {
  const MarchScene& scene = march.kernel;
  const double most_steps = scene.places.empty() ? 4096.0 : 32768.0;  // places may lie far apart
  RayProfile profile;
  Segment all{std::numeric_limits<double>::infinity(), 0.0};
  double dt = std::numeric_limits<double>::infinity();
  const std::vector<GridOnRay> grids = grids_on_ray(scene, ray);
  for (const GridOnRay& on : grids) {
    all = {std::min(all.t0, on.inside.t0), std::max(all.t1, on.inside.t1)};
    dt = std::min(dt, 1.0 / length(on.local.d));
  }
  if (all.empty()) return profile;
  for (const WorldMedium* haze : march.hazes()) {
    const Segment inside = clip_to_box(ray, {0.0, all.t1}, haze->density->bounds());
    if (!inside.empty()) all.t0 = std::min(all.t0, inside.t0);
  }
  profile.dt = std::max(dt, (all.t1 - all.t0) / most_steps);
  profile.t0 = all.t0 + 0.5 * profile.dt;
  profile.sigma.assign(size_t((all.t1 - all.t0) / profile.dt) + 1, 0.0f);
  for (const GridOnRay& on : grids) add_grid(on, profile);
  for (const WorldMedium* haze : march.hazes()) add_haze(*haze, ray, profile);
  return profile;
}

/// Points at equal shares of a ray's opacity.
PilotRay pilot_ray(const MarchWorld& march, const Ray& ray, int points) {
  PilotRay pilot;
  const RayProfile profile = profile_of(march, ray);
  double total = 0.0;
  for (const float sigma : profile.sigma) total += profile.dt * double(sigma);
  const double opaque = opacity_from_tau(total);
  if (!(opaque > 0.0)) return pilot;
  double tau = 0.0;
  size_t step = 0;
  for (int n = 0; n < points; ++n) {
    const double wanted = extinction_from_opacity((n + 0.5) / points * opaque);
    const auto depth = [&] { return profile.dt * double(profile.sigma[step]); };
    while (step + 1 < profile.sigma.size() && tau + depth() < wanted) tau += depth(), ++step;
    const double inside = depth() > 0.0 ? std::min((wanted - tau) / depth(), 1.0) : 0.5;
    PilotPoint point{
        ray.at(profile.t0 + (double(step) + inside - 0.5) * profile.dt), opaque / points, {}, {}};
    for (size_t l = 0; l < march.suns().size(); ++l)
      point.depths.push_back(stepped_depth(march, l, point.p, kPilotStep));
    pilot.points.push_back(std::move(point));
  }
  pilot.direction = ray.d;
  march.weights_for(ray.d, pilot.weights);
  return pilot;
}

Pilots trace_rays(const World& world, const Vec2i& picture, const MarchWorld& march, int points,
                  size_t count) {
  Pilots pilots(count);
  parallel_for(count, [&](size_t n) {
    pilots[n] = pilot_ray(march, world.camera->ray(pilot_pixel(n, picture), picture), points);
  });
  std::erase_if(pilots, [](const PilotRay& pilot) { return pilot.points.empty(); });
  return pilots;
}

/// Depths that count as true, anew.
///   depth_at(light, p)
template <class DepthAt>
void take_depths(Pilots& pilots, DepthAt&& depth_at) {
  parallel_for(pilots.size(), [&](size_t i) {
    for (PilotPoint& point : pilots[i].points) {
      for (size_t l = 0; l < point.depths.size(); ++l) point.depths[l] = depth_at(l, point.p);
    }
  });
}

}  // namespace

double stepped_depth(const MarchWorld& march, size_t light, const Vec3d& p, double step) {
  const Illumination way = march.light_at(light, p);
  double tau = 0.0;
  for (const GridOnRay& on : grids_on_ray(march.kernel, {p, way.wi})) {
    if (!(on.grid.extinction > 0.0)) continue;
    // From where it begins, as kernels count in single precision.
    const Ray local{on.local.at(on.inside.t0), on.local.d};
    double dt = step / length(local.d), end = std::numeric_limits<double>::infinity();
    if (std::isfinite(way.distance)) {
      end = std::min(on.inside.t1, way.distance) - on.inside.t0;
      if (end <= 0.0) continue;
      dt = end / std::ceil(end / dt);
    }
    tau += on.grid.extinction * stepped_column(on.grid, local, dt, end);
  }
  return tau;
}

Pilots trace_pilots(const World& world, const Vec2i& picture, const MarchWorld& march, int points) {
  constexpr size_t kMostPilots = 64 * kFirstPilots, kDenser = 2;
  Pilots pilots;
  for (size_t count = kFirstPilots; count <= kMostPilots && pilots.size() < kEnoughPilots; count *= kDenser)
    pilots = trace_rays(world, picture, march, points, count);
  return pilots;
}

void set_point_weights(const MarchWorld& march, PilotRay& pilot) {
  for (PilotPoint& point : pilot.points) {
    point.weights = pilot.weights;
    march.set_lamp_weights(pilot.direction, point.p, point.weights);
  }
}

void take_fine_depths(const MarchWorld& march, Pilots& pilots) {
  take_depths(pilots, [&](size_t l, const Vec3d& p) { return stepped_depth(march, l, p, kFinePilotStep); });
}

void take_exact_depths(const MarchWorld& march, Pilots& pilots) {
  take_depths(pilots, [&](size_t l, const Vec3d& p) {
    FieldCounters counters;
    return march.exact_depth(l, p, counters);
  });
}

double change_of_light(const MarchWorld& march, const std::vector<float>& weights, size_t light, double depth,
                       double exact) {
  double worst = 0.0;
  for (size_t m = 0; m < march.kernel.media(); ++m) {
    const MarchMedium& medium = march.kernel.medium(m);
    double change = 0.0;
    for (int k = 0; k < medium.terms; ++k) {
      const double a = double(medium.term_extinction[size_t(k)]);
      const double weight = double(weights[(m * march.suns().size() + light) * kMostTerms + size_t(k)]);
      change += weight * (transmittance(a * depth) - transmittance(a * exact));
    }
    if (std::abs(change) > std::abs(worst)) worst = change;
  }
  return worst;
}

double measured_error(const Pilots& pilots, const MarchWorld& march, const DepthAt& depth_at) {
  if (pilots.empty()) return 0.0;
  // What few points do not average out is a reserve of its own.
  const bool has_few = pilots.front().points.size() <= size_t(kFewPoints);
  const double of_mean = has_few ? 3.0 : 3.5, of_worst = has_few ? 1.0 : 1.25;
  std::vector<double> errors(pilots.size());
  parallel_for(errors.size(), [&](size_t i) {
    const PilotRay& ray = pilots[i];
    double sum = 0.0;
    for (const PilotPoint& point : ray.points) {
      for (size_t l = 0; l < march.suns().size(); ++l)
        sum += point.share * change_of_light(march, point.weights, l, depth_at(l, point.p), point.depths[l]);
    }
    errors[i] = std::abs(sum) * ray.scale;
  });
  const double squares = std::inner_product(errors.begin(), errors.end(), errors.begin(), 0.0);
  const double mean = std::sqrt(squares / double(errors.size()));
  return std::max(of_mean * mean, of_worst * *std::max_element(errors.begin(), errors.end()));
}

}  // namespace pileus
