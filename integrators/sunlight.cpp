#include "integrators/sunlight.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "integrators/kernels/sun_kernel.h"
#include "integrators/march_places.h"
#include "integrators/pilot_pixels.h"
#include "integrators/sun_lattice.h"
#include "lib/core/parallel.h"
#include "lib/math/box.h"
#include "lib/math/transmittance.h"

namespace pileus {
namespace {

constexpr size_t kFirstPilots = 336;  ///< pilot rays all over the picture, at first
constexpr size_t kEnoughPilots = 64;  ///< that meet a medium
constexpr double kPilotStep = 0.5;    ///< of the columns that count as true [cells]
constexpr double kFinePilotStep = 0.125;

/// A place where light is scattered towards the camera.
struct PilotPoint {
  Vec3d p;
  double share = 0.0;          ///< of its ray's pixel: opacity / points
  std::vector<double> depths;  ///< towards each sun, as good as exact
};

struct PilotRay {
  std::vector<float> weights;  ///< see MarchRay
  std::vector<PilotPoint> points;
};

using Pilots = std::vector<PilotRay>;

/// Points on a pilot ray. Where nodes stand far apart, errors are alike along much of a ray, and few will do.
/// More of them average out more of the error, as the many samples of a ray do.
constexpr int kFewPoints = 4, kManyPoints = 12;

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

/// Optical depth from a point towards a sun, by steps of about `step` cells.
double stepped_depth(const MarchWorld& march, size_t light, const Vec3d& p, double step) {
  double tau = 0.0;
  for (const GridOnRay& on : grids_on_ray(march.kernel, {p, march.suns()[light].wi})) {
    if (!(on.grid.extinction > 0.0)) continue;
    // From where it begins, as kernels count in single precision.
    const Ray local{on.local.at(on.inside.t0), on.local.d};
    tau += on.grid.extinction * stepped_column(on.grid, local, step / length(local.d));
  }
  return tau;
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
    PilotPoint point{ray.at(profile.t0 + (double(step) + inside - 0.5) * profile.dt), opaque / points, {}};
    for (size_t l = 0; l < march.suns().size(); ++l)
      point.depths.push_back(stepped_depth(march, l, point.p, kPilotStep));
    pilot.points.push_back(std::move(point));
  }
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

/// Pilots as dense as it takes to meet what is small in the picture.
Pilots trace_pilots(const World& world, const Vec2i& picture, const MarchWorld& march, int points) {
  constexpr size_t kMostPilots = 64 * kFirstPilots, kDenser = 2;
  Pilots pilots;
  for (size_t count = kFirstPilots; count <= kMostPilots && pilots.size() < kEnoughPilots; count *= kDenser)
    pilots = trace_rays(world, picture, march, points, count);
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

void take_fine_depths(const MarchWorld& march, Pilots& pilots) {
  take_depths(pilots, [&](size_t l, const Vec3d& p) { return stepped_depth(march, l, p, kFinePilotStep); });
}

void take_exact_depths(const MarchWorld& march, Pilots& pilots) {
  take_depths(pilots, [&](size_t l, const Vec3d& p) {
    FieldCounters counters;
    return march.exact_depth(l, p, counters);
  });
}

/// Change of the light from one sun if its depth is not `exact` but `depth`;
/// where media overlap, of the most sensitive.
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

/// What wrong depths change in a pixel, at worst: depth_at(light, p) are those to be judged. Of many pixels
/// the worst errs several times as much as the root mean square of the pilot rays, or, where errors gather in
/// few places, somewhat more than the worst of these.
template <class DepthAt>
double measured_error(const Pilots& pilots, const MarchWorld& march, DepthAt&& depth_at) {
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
        sum += point.share * change_of_light(march, ray.weights, l, depth_at(l, point.p), point.depths[l]);
    }
    errors[i] = std::abs(sum);
  });
  const double squares = std::inner_product(errors.begin(), errors.end(), errors.begin(), 0.0);
  const double mean = std::sqrt(squares / double(errors.size()));
  return std::max(of_mean * mean, of_worst * *std::max_element(errors.begin(), errors.end()));
}

/// Depth beyond which no sun changes a pilot's pixel by more than `least`.
float enough_depth(const Pilots& pilots, const MarchWorld& march, double least) {
  if (pilots.empty()) return SunLattice::kDeepest;
  float depth = 1.0f;
  const auto is_enough = [&](const PilotRay& pilot) {
    for (size_t l = 0; l < march.suns().size(); ++l) {
      const double beyond =
          change_of_light(march, pilot.weights, l, double(depth), std::numeric_limits<double>::infinity());
      if (std::abs(beyond) > least / double(march.suns().size())) return false;
    }
    return true;
  };
  for (const PilotRay& pilot : pilots) {
    while (depth < SunLattice::kDeepest && !is_enough(pilot)) depth += 0.5f;
  }
  // One more, because balancing lowers depths near the deepest a little.
  return std::min(depth + 1.0f, SunLattice::kDeepest);
}

/// What lattices may be like, and what they have cost.
struct LatticeTrial {
  LatticeOptions options;
  double bytes = 0.0;
};

/// A grid as it stands in the places of a kind.
MarchGrid grid_of(const MarchScene& scene, const MarchKind& kind) {
  MarchGrid grid = scene.grids[kind.grid];
  grid.local_from_world = kind.local_from_world;
  return grid;
}

/// Up to some more than `most`.
double bytes_of(const MarchWorld& march, const LatticeOptions& options, double most) {
  double bytes = 0.0;
  for (const Illumination& sun : march.suns()) {
    for (const MarchKind& kind : march.kernel.kinds) {
      bytes += sun_lattice_bytes(grid_of(march.kernel, kind), sun.wi, options);
      if (bytes > most) return bytes;
    }
  }
  return bytes;
}

/// False where memory does not suffice.
bool build_lattices(MarchWorld& march, LatticeTrial& trial) {
  std::vector<SunLattice>& lattices = march.kernel.lattices;
  lattices.clear();
  const double most_bytes = trial.options.most_bytes;
  trial.bytes = 0.0;
  for (const Illumination& sun : march.suns()) {
    for (const MarchKind& kind : march.kernel.kinds) {
      LatticeOptions options = trial.options;
      options.most_bytes = most_bytes - trial.bytes;
      lattices.push_back(build_sun_lattice(grid_of(march.kernel, kind), sun.wi, options));
      if (lattices.back().bricks.x == 0) return false;
      trial.bytes += double(lattices.back().memory_bytes());
    }
  }
  return true;
}

/// Along the light the depth bends less: only the density's own gradient does it.
LatticeSpacing spaced(double across) {
  constexpr double kAlong = 1.5;
  return {across, kAlong * across};
}

/// How the error depends on the spacing, as far as it has been measured.
class ErrorLaw {
 public:
  void add(double spacing, double error) {
    m_spacing = spacing;
    m_error = error;
  }

  /// The spacing that would err by `allowed` where another errs by `error`. Down to a voxel the error falls
  /// as the grid's details have it; what is finer finds nothing new, and errs as linear interpolation does.
  double spacing_for(double spacing, double error, double allowed) const {
    constexpr double kVoxel = 1.0, kBelowVoxel = 2.5;
    const double power = power_at(spacing, error), needed = spacing * std::pow(allowed / error, 1.0 / power);
    if (needed >= kVoxel) return needed;
    const double from = std::min(spacing, kVoxel), error_from = error * std::pow(from / spacing, power);
    return from * std::pow(std::min(1.0, allowed / error_from), 1.0 / kBelowVoxel);
  }

 private:
  double power_at(double spacing, double error) const {
    constexpr double kUsual = 1.7, kLeast = 1.7, kMost = 2.5;  // little where there are details of all sizes
    if (!(m_spacing > 0.0)) return kUsual;
    return std::clamp(std::log(error / m_error) / std::log(spacing / m_spacing), kLeast, kMost);
  }

  double m_spacing = 0.0, m_error = 0.0;  ///< measured before
};

/// Tries lattices, finer until they are good enough; false where memory ends
/// first.
///   trace: makes pilots
bool try_lattices(const std::function<Pilots(int points)>& trace, double tolerance, double most_bytes,
                  MarchWorld& march, SunlightChoice& choice) {
  constexpr double kFirst = 4.0, kFinest = 0.1;  // spacings across [cells]
  constexpr double kFine = 2.5;                  // spacing from which on many points tell more,
  constexpr double kFiner = 0.8;     // from which on steps of half a cell are too long to judge by,
  constexpr double kVeryFine = 0.4;  // and from which on any are
  constexpr int kRounds = 5;
  // A further lattice costs more than one that is a little too fine. A long way
  // is gone in two steps: the first costs little and tells where the second has
  // to go.
  constexpr double kCautious = 0.92, kConfident = 0.98, kLongWay = 0.4;
  // Measured errors scatter by a fifth, by where lines happen to lie: a little finer might be no better.
  constexpr double kFinerAtLeast = 0.88;
  // To shorten all steps a little costs less than another lattice.
  constexpr double kGoodEnough = 1.1;
  constexpr double kEnoughShare = 0.02;
  const double allowed = (1.0 - kEnoughShare) * tolerance, enough = kGoodEnough * allowed;
  Pilots pilots = trace(kFewPoints);
  bool has_many = false, has_fine = false, has_exact = false;
  LatticeTrial trial;
  trial.options.most_bytes = most_bytes;
  trial.options.is_everywhere = march.kernel.media() > 1 || !march.kernel.places.empty();
  trial.options.enough = enough_depth(pilots, march, kEnoughShare * tolerance);
  const auto measure = [&] {
    return measured_error(pilots, march,
                          [&](size_t l, const Vec3d& p) { return lattice_depth(march.kernel, l, p); });
  };
  ErrorLaw law;
  choice.spacing = kFirst;
  for (int round = 0; round < kRounds && choice.spacing >= kFinest; ++round) {
    trial.options.spacing = spaced(choice.spacing);
    const double most = 2.0 * most_bytes;
    if (bytes_of(march, trial.options, most) > most || !build_lattices(march, trial)) return false;
    double error = measure();
    // Whether the lattice fails, and the next one is to have less than this spacing.
    const auto asks_for = [&](double spacing) {
      return error > enough && law.spacing_for(choice.spacing, error, allowed) < spacing;
    };
    if (!has_many && asks_for(kFine)) {
      pilots = trace(kManyPoints);
      has_many = true;
      error = measure();
    }
    if (!has_fine && asks_for(kFiner)) {
      take_fine_depths(march, pilots);
      has_fine = true;
      error = measure();
    }
    if (!has_exact && asks_for(kVeryFine)) {
      take_exact_depths(march, pilots);
      has_exact = true;
      error = measure();
    }
    choice.error = error + kEnoughShare * tolerance;
    if (error <= enough) {
      choice.reason = fmt::format(
          "optical depth on lattices of {:.2g} by {:.2g} voxels, {:.1f} MB: estimated error {:.2g}",
          trial.options.spacing.across, trial.options.spacing.along, 1e-6 * trial.bytes, choice.error);
      return true;
    }
    const double needed = law.spacing_for(choice.spacing, error, allowed);
    law.add(choice.spacing, error);
    if (round == 0 && needed < kLongWay * choice.spacing) {
      choice.spacing = std::sqrt(needed * choice.spacing);
    } else {
      choice.spacing =
          std::min(needed * (round == 0 ? kCautious : kConfident), kFinerAtLeast * choice.spacing);
    }
  }
  return false;
}

void take_shadow_rays(Pilots pilots, double tolerance, MarchWorld& march, SunlightChoice& choice) {
  take_exact_depths(march, pilots);
  constexpr double kLongest = 1.0, kShortest = 1.0 / 16.0;  // steps [cells]
  for (choice.step = kLongest;; choice.step *= 0.5) {
    choice.error = measured_error(
        pilots, march, [&](size_t l, const Vec3d& p) { return stepped_depth(march, l, p, choice.step); });
    if (choice.error <= tolerance || choice.step <= kShortest) break;
  }
  march.kernel.shadow_step = choice.step;
}

/// The most sunlight that any ray of the picture can get from an opaque medium. Phase functions may be
/// narrow: a raster as fine as theirs is looked at.
double brightest_sunlight(const World& world, const Vec2i& picture, const MarchWorld& march) {
  const Vec2i raster = march.is_isotropic() ? Vec2i(1, 1) : Vec2i(96, 54);
  double brightest = 0.0;
  std::vector<float> weights;
  for (int i = 0; i < raster.x * raster.y; ++i) {
    const Vec2d pixel((i % raster.x + 0.5) / raster.x * picture.x,
                      (i / raster.x + 0.5) / raster.y * picture.y);
    march.weights_for(world.camera->ray(pixel, picture).d, weights);
    brightest = std::max(brightest, march.sunlit(weights.data()));
  }
  return brightest;
}

/// Pilots are few: none may look where a narrow phase function scatters most, so all are judged as if they
/// did.
void judge_as_brightest(const MarchWorld& march, double brightest, PilotRay& pilot) {
  const double own = march.sunlit(pilot.weights.data());
  if (!(own > 0.0)) return;
  for (float& weight : pilot.weights) weight *= float(brightest / own);
}

}  // namespace

SunlightChoice choose_sunlight(const World& world, const Vec2i& picture, double tolerance, double most_bytes,
                               MarchWorld& march) {
  SunlightChoice choice;
  choice.brightest = brightest_sunlight(world, picture, march);
  if (march.kernel.grids.empty()) {
    choice.reason = "in closed form: no medium is a grid";
    return choice;
  }
  const auto trace = [&](int points) {
    Pilots pilots = trace_pilots(world, picture, march, points);
    for (PilotRay& pilot : pilots) judge_as_brightest(march, choice.brightest, pilot);
    return pilots;
  };
  if (most_bytes > 0.0 && try_lattices(trace, tolerance, most_bytes, march, choice)) return choice;
  march.kernel.lattices.clear();
  const std::string why =
      most_bytes > 0.0 ? fmt::format("a cache within {:.2g} would need more than the {:.0f} MB allowed",
                                     tolerance, 1e-6 * most_bytes)
                       : "no cache asked for";
  choice.spacing = 0.0;
  take_shadow_rays(trace(kFewPoints), tolerance, march, choice);
  choice.reason = fmt::format("shadow rays with steps of {:.2g} voxels ({}): estimated error {:.2g}",
                              choice.step, why, choice.error);
  return choice;
}

}  // namespace pileus
