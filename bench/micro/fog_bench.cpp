// Fog by distance evaluated per point, from a table and between the corners of tiles: what each errs by and
// takes.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "integrators/fog_corners.h"
#include "integrators/ray_fog.h"
#include "lib/scene/world.h"

namespace pileus::bench {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// A plain with a ball on it, in haze of which a third shows at the ball.
World plain_in_haze(const std::string& per) {
  const Scene scene = parse_scene(
      "pileus = 1\n[camera]\ntype = \"perspective\"\nposition = [0, 30, 0]\nlook_at = [0, 20, -100]\n"
      "[object.plain]\ntype = \"plane\"\n[object.ball]\ntype = \"sphere\"\ncenter = [20, 30, -500]\nradius = "
      "40\n"
      "[fog.haze]\ntype = \"distance\"\ndensity = 0.002\nper = \"" +
          per + "\"\n",
      "fog_bench", "");
  return build_world(scene);
}

/// Of the ends of all camera rays of a picture of 640 x 360; their distances are found beforehand.
void BM_fog(benchmark::State& state, const std::string& per) {
  const World world = plain_in_haze(per);
  const Vec2i size(640, 360);
  std::vector<Ray> rays;
  std::vector<double> ends;
  for (int i = 0; i < size.x * size.y; ++i) {
    rays.push_back(world.camera->ray(Vec2d(i % size.x + 0.5, double(i / size.x) + 0.5), size));
    const auto hit = nearest_surface(world, rays.back(), {0.0, kNever});
    ends.push_back(hit ? hit->t : kNever);
  }
  const FogSetup setup(world, 0.002, size);
  RayFog fog(setup);
  std::vector<double> shown(rays.size());
  for (auto _ : state) {
    for (size_t i = 0; i < rays.size(); ++i) {
      fog.build(rays[i], ends[i], true);
      shown[i] = fog.end().transmittance;
    }
  }
  double most = 0.0, squares = 0.0;
  for (size_t i = 0; i < rays.size(); ++i) {
    const double error = std::abs(shown[i] - std::exp(-0.002 * ends[i]));
    most = std::max(most, error);
    squares += error * error;
  }
  state.counters["ns_per_ray"] =
      benchmark::Counter(double(rays.size()) * 1e-9,
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["max_error"] = most;
  state.counters["rms_error"] = std::sqrt(squares / double(rays.size()));
}
BENCHMARK_CAPTURE(BM_fog, pixel, "pixel")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_fog, table, "table")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_fog, vertex, "vertex")->Unit(benchmark::kMillisecond);

/// The corners themselves, once per picture.
void BM_fog_corners(benchmark::State& state) {
  const World world = plain_in_haze("vertex");
  const FogSetup without_picture(world, 0.002, {0, 0});
  for (auto _ : state) {
    benchmark::DoNotOptimize(FogCorners(world, *without_picture.alone, world.fogs.front().view, {640, 360}));
  }
}
BENCHMARK(BM_fog_corners)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pileus::bench
