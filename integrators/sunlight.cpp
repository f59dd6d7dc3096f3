#include "integrators/sunlight.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "integrators/sun_lattice.h"
#include "lib/core/parallel.h"
#include "lib/math/transmittance.h"

namespace pileus {
namespace {

constexpr int kColumns = 24, kRows = 14;  ///< pilot rays across the picture, at first
constexpr size_t kEnoughPilots = 32;      ///< that meet a medium
constexpr int kPointsPerRay = 4;

/// A place where light is scattered towards the camera.
struct PilotPoint {
  Vec3d p;
  double share = 0.0;          ///< of its ray's pixel: opacity / points
  std::vector<double> depths;  ///< exact, towards each sun
};

struct PilotRay {
  Vec3d direction;
  std::vector<PilotPoint> points;
};

/// Points at equal shares of a ray's opacity.
PilotRay pilot_ray(const World& world, const Ray& ray, FieldCounters& counters) {
  PilotRay pilot{ray.d, {}};
  std::vector<DensityPiece> pieces;
  std::vector<std::pair<double, double>> depths;  // t at a piece's middle, optical depth of the piece
  for (const WorldMedium& medium : world.media) {
    pieces.clear();
    medium.density->append_pieces(ray, {0.0, std::numeric_limits<double>::infinity()}, pieces, counters);
    for (const DensityPiece& piece : pieces) {
      depths.emplace_back(0.5 * (piece.t0 + piece.t1), medium.extinction * column_to(piece, piece.t1));
    }
  }
  std::sort(depths.begin(), depths.end());
  double total = 0.0;
  for (const auto& [t, tau] : depths) total += tau;
  const double opaque = opacity_from_tau(total);
  double tau = 0.0;
  for (const auto& [t, piece_tau] : depths) {
    tau += piece_tau;
    const double reached = (double(pilot.points.size()) + 0.5) / kPointsPerRay * opaque;
    if (pilot.points.size() < kPointsPerRay && opaque > 0.0 && opacity_from_tau(tau) >= reached) {
      pilot.points.push_back({ray.at(t), opaque / kPointsPerRay, {}});
    }
  }
  return pilot;
}

std::vector<PilotRay> trace_pilots(const World& world, const Vec2i& picture, const MarchWorld& march,
                                   int columns, int rows) {
  std::vector<PilotRay> pilots(size_t(columns) * size_t(rows));
  parallel_for(pilots.size(), [&](size_t i) {
    FieldCounters counters;
    const Vec2d pixel((double(i % size_t(columns)) + 0.5) / columns * picture.x,
                      (double(i / size_t(columns)) + 0.5) / rows * picture.y);
    pilots[i] = pilot_ray(world, world.camera->ray(pixel, picture), counters);
    for (PilotPoint& point : pilots[i].points) {
      for (size_t l = 0; l < march.suns().size(); ++l)
        point.depths.push_back(march.exact_depth(l, point.p, counters));
    }
  });
  std::erase_if(pilots, [](const PilotRay& pilot) { return pilot.points.empty(); });
  return pilots;
}

/// Pilots as dense as it takes to meet what is small in the picture.
std::vector<PilotRay> trace_enough_pilots(const World& world, const Vec2i& picture, const MarchWorld& march) {
  std::vector<PilotRay> pilots;
  for (int density = 1; density <= 8 && pilots.size() < kEnoughPilots; density *= 2)
    pilots = trace_pilots(world, picture, march, density * kColumns, density * kRows);
  return pilots;
}

/// Change of the light from one sun if its depth is not `exact` but `depth`; where grids overlap, of the most
/// sensitive.
double change_of_light(const MarchWorld& march, const std::vector<float>& weights, size_t light, double depth,
                       double exact) {
  double worst = 0.0;
  for (size_t g = 0; g < march.kernel.grids.size(); ++g) {
    const MarchGrid& grid = march.kernel.grids[g];
    double change = 0.0;
    for (int k = 0; k < grid.terms; ++k) {
      const double a = double(grid.term_extinction[size_t(k)]);
      const double weight = double(weights[(g * march.suns().size() + light) * kMostTerms + size_t(k)]);
      change += weight * (transmittance(a * depth) - transmittance(a * exact));
    }
    if (std::abs(change) > std::abs(worst)) worst = change;
  }
  return worst;
}

/// What wrong depths change in a pixel, at worst: depth_at(light, p) are those to be judged.
template <class DepthAt>
double measured_error(const std::vector<PilotRay>& pilots, const MarchWorld& march, DepthAt&& depth_at) {
  // The worst pixels err this much more than the root mean square over rays with a few points each.
  constexpr double kPeak = 3.0;
  std::vector<double> squares(pilots.size());
  parallel_for(pilots.size(), [&](size_t i) {
    std::vector<float> weights;
    march.weights_for(pilots[i].direction, weights);
    double sum = 0.0;
    for (const PilotPoint& point : pilots[i].points) {
      for (size_t l = 0; l < march.suns().size(); ++l) {
        sum += point.share * change_of_light(march, weights, l, depth_at(l, point.p), point.depths[l]);
      }
    }
    squares[i] = sum * sum;
  });
  const double total = std::accumulate(squares.begin(), squares.end(), 0.0);
  return pilots.empty() ? 0.0 : kPeak * std::sqrt(total / double(pilots.size()));
}

double lattice_depth(const MarchWorld& march, size_t light, const Vec3d& p) {
  const size_t grids = march.kernel.grids.size();
  double depth = 0.0;
  for (size_t g = 0; g < grids; ++g) depth += sun_depth(march.kernel.lattices[light * grids + g], p);
  return depth;
}

double bytes_of(const MarchWorld& march, double spacing) {
  double nodes = 0.0;
  for (const Illumination& sun : march.suns()) {
    for (const MarchGrid& grid : march.kernel.grids) nodes += sun_lattice_nodes(grid, sun.wi, spacing);
  }
  return sizeof(float) * nodes;
}

void build_lattices(MarchWorld& march, double spacing) {
  march.kernel.lattices.clear();
  for (const Illumination& sun : march.suns()) {
    for (const MarchGrid& grid : march.kernel.grids) {
      march.kernel.lattices.push_back(build_sun_lattice(grid, sun.wi, spacing));
    }
  }
}

/// Tries lattices, finer until they are good enough; false where memory ends first.
bool try_lattices(const std::vector<PilotRay>& pilots, double tolerance, double most_bytes, MarchWorld& march,
                  SunlightChoice& choice) {
  constexpr double kFirst = 4.0, kCoarsest = 8.0, kFinest = 0.1;  // spacings [cells]
  constexpr int kRounds = 3;
  // A third lattice costs more than one that is a little too fine, unless that one would be too large.
  constexpr double kCautious = 0.85, kBold = 0.97;
  choice.spacing = kFirst;
  for (int round = 0; round < kRounds; ++round) {
    const double bytes = bytes_of(march, choice.spacing);
    if (bytes > most_bytes) return false;
    build_lattices(march, choice.spacing);
    choice.error =
        measured_error(pilots, march, [&](size_t l, const Vec3d& p) { return lattice_depth(march, l, p); });
    const double ratio = std::sqrt(tolerance / std::max(choice.error, 1e-30));
    const auto spaced = [&](double share) {
      return std::clamp(share * choice.spacing * ratio, kFinest, kCoarsest);
    };
    const double needed = spaced(bytes_of(march, spaced(kCautious)) > most_bytes ? kBold : kCautious);
    if (choice.error <= tolerance && (needed < 1.5 * choice.spacing || round > 0)) {
      choice.reason =
          fmt::format("optical depth on lattices of {:.2g} voxels, {:.1f} MB: estimated error {:.2g}",
                      choice.spacing, 1e-6 * bytes, choice.error);
      return true;
    }
    choice.spacing = needed;
  }
  return false;
}

void take_shadow_rays(const std::vector<PilotRay>& pilots, double tolerance, MarchWorld& march,
                      SunlightChoice& choice) {
  constexpr double kLongest = 1.0, kShortest = 1.0 / 16.0;  // steps [cells]
  for (choice.step = kLongest;; choice.step *= 0.5) {
    choice.error = measured_error(
        pilots, march, [&](size_t l, const Vec3d& p) { return march.stepped_depth(l, p, choice.step); });
    if (choice.error <= tolerance || choice.step <= kShortest) break;
  }
  march.kernel.shadow_step = choice.step;
}

}  // namespace

SunlightChoice choose_sunlight(const World& world, const Vec2i& picture, double tolerance, double most_bytes,
                               MarchWorld& march) {
  const std::vector<PilotRay> pilots = trace_enough_pilots(world, picture, march);
  SunlightChoice choice;
  if (most_bytes > 0.0 && try_lattices(pilots, tolerance, most_bytes, march, choice)) return choice;
  march.kernel.lattices.clear();
  const std::string why =
      most_bytes > 0.0 ? fmt::format("a cache within {:.2g} would need {:.0f} MB of {:.0f} MB allowed",
                                     tolerance, 1e-6 * bytes_of(march, choice.spacing), 1e-6 * most_bytes)
                       : "no cache asked for";
  choice.spacing = 0.0;
  take_shadow_rays(pilots, tolerance, march, choice);
  choice.reason = fmt::format("shadow rays with steps of {:.2g} voxels ({}): estimated error {:.2g}",
                              choice.step, why, choice.error);
  return choice;
}

}  // namespace pileus
