#include "integrators/sun_cache.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "integrators/sun_lattice.h"
#include "lib/core/parallel.h"
#include "lib/math/transmittance.h"

namespace pileus {
namespace {

constexpr double kCoarsest = 8.0, kFinest = 0.5;  ///< spacings worth trying [cells]
constexpr int kColumns = 24, kRows = 14;          ///< pilot rays across the picture, at first
constexpr size_t kEnoughPilots = 32;              ///< that meet a medium
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

/// Root mean square over the pilots of what the lattices' errors change in a pixel.
double measured_error(const std::vector<PilotRay>& pilots, const MarchWorld& march) {
  const size_t grids = march.kernel.grids.size(), lights = march.suns().size();
  std::vector<double> squares(pilots.size());
  parallel_for(pilots.size(), [&](size_t i) {
    std::vector<float> weights;
    march.weights_for(pilots[i].direction, weights);
    double sum = 0.0;
    for (const PilotPoint& point : pilots[i].points) {
      for (size_t l = 0; l < lights; ++l) {
        double depth = 0.0;
        for (size_t g = 0; g < grids; ++g) depth += sun_depth(march.kernel.lattices[l * grids + g], point.p);
        // The grid with the strongest answer stands for all.
        double worst = 0.0;
        for (size_t g = 0; g < grids; ++g) {
          const MarchGrid& grid = march.kernel.grids[g];
          double change = 0.0;
          for (int k = 0; k < grid.terms; ++k) {
            const double a = double(grid.term_extinction[size_t(k)]);
            change += double(weights[(g * lights + l) * kMostTerms + size_t(k)]) *
                      (transmittance(a * depth) - transmittance(a * point.depths[l]));
          }
          if (std::abs(change) > std::abs(worst)) worst = change;
        }
        sum += point.share * worst;
      }
    }
    squares[i] = sum * sum;
  });
  double total = 0.0;
  for (const double square : squares) total += square;
  return pilots.empty() ? 0.0 : std::sqrt(total / double(pilots.size()));
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

}  // namespace

SunCacheChoice build_sun_cache(const World& world, const Vec2i& picture, double tolerance, double most_bytes,
                               MarchWorld& march) {
  // The worst pixels err this much more than the root mean square of a few points per ray.
  constexpr double kPeak = 3.0;
  const std::vector<PilotRay> pilots = trace_enough_pilots(world, picture, march);
  SunCacheChoice choice;
  choice.spacing = 4.0;
  for (int round = 0; round < 3; ++round) {
    choice.bytes = bytes_of(march, choice.spacing);
    if (choice.spacing < kFinest || choice.bytes > most_bytes) break;
    build_lattices(march, choice.spacing);
    choice.error = kPeak * measured_error(pilots, march);
    const double needed = std::clamp(
        0.95 * choice.spacing * std::sqrt(tolerance / std::max(choice.error, 1e-30)), 0.1, kCoarsest);
    const bool is_enough = choice.error <= tolerance;
    if (is_enough && (needed < 1.5 * choice.spacing || round > 0)) {
      choice.is_cached = true;
      choice.reason = fmt::format(
          "optical depth towards {} sun{} on lattices of {:.2g} voxels, {:.1f} MB: estimated error {:.2g}",
          march.suns().size(), march.suns().size() == 1 ? "" : "s", choice.spacing, 1e-6 * choice.bytes,
          choice.error);
      return choice;
    }
    choice.spacing = needed;
  }
  march.kernel.lattices.clear();
  choice.is_cached = false;
  choice.reason = fmt::format(
      "a shadow ray per sample: a cache within {:.2g} would need a spacing of {:.2g} voxels, {:.0f} MB of "
      "{:.0f} MB allowed",
      tolerance, choice.spacing, 1e-6 * choice.bytes, 1e-6 * most_bytes);
  choice.error = 0.0;
  return choice;
}

}  // namespace pileus
