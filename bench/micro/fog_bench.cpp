// What evaluations of fog err by and take, at the ends of all rays of a picture; and the tables of the
// marcher.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "integrators/fog_corners.h"
#include "integrators/march_fog.h"
#include "integrators/ray_fog.h"
#include "lib/scene/world.h"

namespace pileus::bench {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
const Vec2i kSize(640, 360);

const std::string kDistance = "[fog.a]\ntype = \"distance\"\ndensity = 0.002\n",
                  kHeight = "[fog.b]\ntype = \"height\"\nextinction = 0.004\nscale_height = 25\n",
                  kLayer =
                      "[fog.c]\ntype = \"layer\"\ncenter = [0, 20, -300]\nradii = [200, 30, 200]\n"
                      "extinction = 0.002\nextinction_top = 0.02\n",
                  kLit =
                      "[fog.d]\ntype = \"sunlit_layer\"\nthickness = 50\nextinction = 0.01\nsun = \"sun\"\n",
                  kLegacy = "form = \"legacy\"\n";

/// A plain with a ball on it in fog, of which some shows at the ball.
World plain_in(const std::string& fogs) {
  const Scene scene = parse_scene(
      "pileus = 1\n[camera]\ntype = \"perspective\"\nposition = [0, 30, 0]\nlook_at = [0, 20, -100]\n"
      "[light.sun]\ntype = \"sun\"\n[object.plain]\ntype = \"plane\"\n"
      "[object.ball]\ntype = \"sphere\"\ncenter = [20, 30, -500]\nradius = 40\n" +
          fogs,
      "fog_bench", "");
  return build_world(scene);
}

struct End {
  Ray ray;
  double t;
};

std::vector<End> ends_of_picture(const World& world) {
  std::vector<End> ends;
  for (int i = 0; i < kSize.x * kSize.y; ++i) {
    const Ray ray = world.camera->ray(Vec2d(i % kSize.x + 0.5, double(i / kSize.x) + 0.5), kSize);
    const auto hit = nearest_surface(world, ray, {0.0, kNever});
    ends.push_back({ray, hit ? hit->t : kNever});
  }
  return ends;
}

std::vector<Veil> veils(const FogSetup& setup, std::span<const End> ends) {
  RayFog fog(setup);
  std::vector<Veil> found;
  for (const End& end : ends) {
    fog.build(end.ray, end.t, true);
    found.push_back(fog.end());
  }
  return found;
}

/// Largest of the transmittance and of the light in any channel.
double difference(const Veil& a, const Veil& b) {
  const Rgb light = a.light - b.light;
  return std::max(
      {std::abs(a.transmittance - b.transmittance), std::abs(light.x), std::abs(light.y), std::abs(light.z)});
}

void tell_errors(benchmark::State& state, std::span<const Veil> found, std::span<const Veil> expected) {
  double most = 0.0, squares = 0.0;
  for (size_t i = 0; i < found.size(); ++i) {
    const double error = difference(found[i], expected[i]);
    most = std::max(most, error);
    squares += error * error;
  }
  state.counters["max_error"] = most;
  state.counters["rms_error"] = std::sqrt(squares / double(found.size()));
}

void tell_time(benchmark::State& state, size_t rays) {
  state.SetItemsProcessed(state.iterations() * int64_t(rays));
}

/// Distances are found beforehand.
///   exact: the fog that it stands for, to be evaluated to rounding
void BM_fog(benchmark::State& state, const std::string& fogs, const std::string& exact) {
  const World world = plain_in(fogs), exact_world = plain_in(exact);
  const std::vector<End> ends = ends_of_picture(world);
  const FogSetup setup(world, 0.002, kSize);
  std::vector<Veil> found;
  for (auto _ : state) found = veils(setup, ends);
  tell_time(state, ends.size());
  tell_errors(state, found, veils(FogSetup(exact_world, 0.0, kSize), ends));
}
#define PILEUS_FOG_BENCH(name, fogs, exact) \
  BENCHMARK_CAPTURE(BM_fog, name, fogs, exact)->Unit(benchmark::kMillisecond)
PILEUS_FOG_BENCH(distance_per_pixel, kDistance, kDistance);
PILEUS_FOG_BENCH(distance_per_table, kDistance + "per = \"table\"\n", kDistance);
PILEUS_FOG_BENCH(distance_per_vertex, kDistance + "per = \"vertex\"\n", kDistance);
PILEUS_FOG_BENCH(height, kHeight, kHeight);
PILEUS_FOG_BENCH(layer, kLayer, kLayer);
PILEUS_FOG_BENCH(layer_legacy, kLayer + kLegacy, kLayer);
PILEUS_FOG_BENCH(sunlit_layer, kLit, kLit);
PILEUS_FOG_BENCH(sunlit_layer_legacy, kLit + kLegacy, kLit);
PILEUS_FOG_BENCH(distance_and_layer, kDistance + kLayer, kDistance + kLayer);
PILEUS_FOG_BENCH(all_four, kDistance + kHeight + kLayer + kLit, kDistance + kHeight + kLayer + kLit);

/// The corners of per = "vertex", once per picture.
void BM_fog_corners(benchmark::State& state) {
  const World world = plain_in(kDistance + "per = \"vertex\"\n");
  const FogSetup without_picture(world, 0.002, {0, 0});
  for (auto _ : state) {
    benchmark::DoNotOptimize(FogCorners(world, *without_picture.alone, world.fogs.front().view, kSize));
  }
}
BENCHMARK(BM_fog_corners)->Unit(benchmark::kMillisecond);

/// What the marcher reads in front of media, here from 100 m to 900 m, of a fiftieth of the tolerance.
void BM_march_fog(benchmark::State& state, const std::string& fogs) {
  const World world = plain_in(fogs);
  const FogSetup setup(world, 0.002, kSize);
  RayFog fog(setup);
  MarchFog table;
  MarchFogError error;
  double nodes = 0.0, most = 0.0;
  const size_t rays = 1000;
  for (auto _ : state) {
    nodes = 0.0;
    for (size_t i = 0; i < rays; ++i) {
      const Vec2d pixel(double(i * 37 % size_t(kSize.x)), double(i * 101 % size_t(kSize.y)));
      fog.build(world.camera->ray(pixel, kSize), 900.0, true);
      error = tabulate(fog, {100.0, 900.0}, 4e-5, table);
      most = std::max({most, error.transmittance, error.light});
      nodes += double(table.nodes.size()) / double(rays);
    }
  }
  tell_time(state, rays);
  state.counters["max_error"] = most;
  state.counters["nodes"] = nodes;
}
BENCHMARK_CAPTURE(BM_march_fog, distance, kDistance);
BENCHMARK_CAPTURE(BM_march_fog, height, kHeight);
BENCHMARK_CAPTURE(BM_march_fog, all_four, kDistance + kHeight + kLayer + kLit);

}  // namespace
}  // namespace pileus::bench
