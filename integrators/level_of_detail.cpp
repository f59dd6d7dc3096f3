#include "integrators/level_of_detail.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "integrators/pilot_pixels.h"
#include "integrators/pixel_cone.h"
#include "lib/math/box.h"

namespace pileus {
namespace {

constexpr int kMostLevels = 6;

/// The narrowest of the cones of pixels at the picture's centre and at its corners.
PixelCone narrowest_cone(const World& world, const Vec2i& picture) {
  PixelCone narrowest = middle_pixel_cone(world, picture);
  for (int n = 0; n < 4; ++n) {
    const Vec2d corner(n & 1 ? picture.x - 1.5 : 0.5, n & 2 ? picture.y - 1.5 : 0.5);
    const PixelCone cone = pixel_cone(*world.camera, corner, picture);
    narrowest.at_camera = std::min(narrowest.at_camera, cone.at_camera);
    narrowest.per_metre = std::min(narrowest.per_metre, cone.per_metre);
  }
  return narrowest;
}

double distance_to(const Box3d& box, const Vec3d& p) {
  Vec3d away(0.0);
  for (int axis = 0; axis < 3; ++axis)
    away[axis] = std::max({0.0, box.min[axis] - p[axis], p[axis] - box.max[axis]});
  return length(away);
}

/// The longest edge of a voxel [m].
double voxel_size(const DensityField& field) {
  const Affine world_from_index = field.index_from_world().inverse();
  double longest = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d edge(0.0);
    edge[axis] = 1.0;
    longest = std::max(longest, length(world_from_index.direction(edge)));
  }
  return longest;
}

bool meets_a_medium(const World& world, const Ray& ray) {
  return std::any_of(world.media.begin(), world.media.end(), [&](const WorldMedium& medium) {
    const Segment all{0.0, std::numeric_limits<double>::infinity()};
    return !clip_to_box(ray, all, medium.density->bounds()).empty();
  });
}

/// Rays all over the picture that come near a medium; as dense as it takes to meet what is small.
std::vector<Ray> pilot_rays(const World& world, const Vec2i& picture) {
  constexpr size_t kFirst = 336, kMost = 1024 * kFirst, kDenser = 4, kEnough = 256;
  std::vector<Ray> rays;
  size_t n = 0;
  for (size_t count = kFirst; count <= kMost && rays.size() < kEnough; count *= kDenser) {
    for (; n < count; ++n) {
      const Ray ray = world.camera->ray(pilot_pixel(n, picture), picture);
      if (meets_a_medium(world, ray)) rays.push_back(ray);
    }
  }
  return rays;
}

/// What the levels change in a pixel, at worst; infinite where too few pilots met something to tell.
double measured_error(const std::vector<RayResult>& exact, const std::vector<RayResult>& coarse) {
  constexpr double kPeak = 3.0;  // the worst pixels err this much more than the root mean square
  constexpr size_t kFew = 24;
  double squares = 0.0;
  size_t count = 0;
  for (size_t i = 0; i < exact.size(); ++i) {
    if (exact[i].transmittance == 1.0 && coarse[i].transmittance == 1.0) continue;
    const Rgb d = exact[i].radiance - coarse[i].radiance;
    const double worst = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
    squares += worst * worst;
    ++count;
  }
  return count < kFew ? std::numeric_limits<double>::infinity() : kPeak * std::sqrt(squares / double(count));
}

uint64_t samples_of(const std::vector<RayResult>& results) {
  return std::accumulate(results.begin(), results.end(), uint64_t(0),
                         [](uint64_t sum, const RayResult& result) { return sum + result.samples; });
}

double bytes_of_values(const MarchWorld& march, size_t grid) {
  return double(march.kernel.grids[grid].pyramid->bytes_of_values());
}

/// Steps follow from the tolerance, not from the voxels: where a grid is smooth a coarser level saves memory
/// traffic, but no samples; its larger nodes may even cost some. That pays where the values do not stay in a
/// core's cache anyway.
double most_work(double bytes_of_values) {
  constexpr double kCacheBytes = 2e6;
  return bytes_of_values > kCacheBytes ? 1.5 : 1.0;
}

}  // namespace

std::vector<int> coarsest_levels(const World& world, const Vec2i& picture) {
  const PixelCone cone = narrowest_cone(world, picture);
  const Vec3d camera = world.camera->ray(0.5 * Vec2d(picture), picture).o;
  std::vector<int> levels;
  for (const WorldMedium& medium : world.media) {
    int& level = levels.emplace_back(0);
    const double pixel = cone.width(distance_to(medium.density->bounds(), camera));
    const double voxel = voxel_size(*medium.density);
    while (level < kMostLevels && std::ldexp(voxel, level + 1) <= pixel) ++level;
  }
  return levels;
}

LevelChoice choose_levels(const World& world, const Vec2i& picture, double tolerance,
                          const std::vector<int>& coarsest, const PilotMarch& march_pilots,
                          MarchWorld& march) {
  LevelChoice choice;
  const std::vector<Ray> pilots = pilot_rays(world, picture);
  const std::vector<RayResult> exact = march_pilots(pilots);
  for (size_t g = 0; g < coarsest.size(); ++g) {
    const double allowed = tolerance * double(g + 1) / double(coarsest.size());
    const std::string& name = world.media[g].name;
    const double bytes_before = bytes_of_values(march, g);
    std::string why = "a pixel shows no more";
    while (march.level(g) < coarsest[g]) {
      const double most = most_work(bytes_of_values(march, g));
      std::optional<MarchWorld::GridLevel> next = march.coarser_level(g);
      if (!next) {
        why = "the next would take too much memory";
        break;
      }
      MarchWorld::GridLevel before = march.exchange_level(g, std::move(*next));
      const std::vector<RayResult> coarse = march_pilots(pilots);
      const double error = measured_error(exact, coarse);
      const double work = double(samples_of(coarse)) / std::max(1.0, double(samples_of(exact)));
      if (!(error <= allowed) || work > most) {
        march.exchange_level(g, std::move(before));
        why = error <= allowed
                  ? fmt::format("the next would take {:.2g} times the samples", work)
                  : fmt::format("the next would err by {:.2g}, of {:.2g} allowed", error, allowed);
        break;
      }
      choice.error = error;
      choice.is_coarser = true;
    }
    const std::string now = fmt::format("density of {} at level {} of {}", name, march.level(g), coarsest[g]);
    if (march.level(g) == 0) {
      choice.reasons.push_back(fmt::format("{}: {}", now, why));
    } else {
      choice.reasons.push_back(fmt::format("{}, {:.3g} MB of {:.3g} MB ({}): estimated error {:.2g}", now,
                                           1e-6 * bytes_of_values(march, g), 1e-6 * bytes_before, why,
                                           choice.error));
    }
  }
  return choice;
}

}  // namespace pileus
