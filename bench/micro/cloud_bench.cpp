// Building a procedural cloud into a grid, on all cores.
#include <algorithm>
#include <cmath>

#include <benchmark/benchmark.h>

#include "bench/micro/fixtures.h"
#include "lib/cloud/cloud_formula.h"
#include "lib/core/parallel.h"
#include "lib/freeform/shapes.h"
#include "lib/noise/fbm.h"
#include "vdb_io/openvdb/build_cloud.h"
#include "vdb_io/openvdb/grid_to_field.h"
#include "vdb_io/openvdb/openvdb_library.h"

namespace pileus::bench {
namespace {

/// An item is a voxel of the cloud's bounding box, so that work saved in empty space counts.
void build(benchmark::State& state) {
  initialize_openvdb();
  CloudGridOptions options;
  options.voxel_size = cumulus_voxel_size(int(state.range(0)));
  int64_t active = 0;
  for (auto _ : state) active = int64_t(build_cloud(cumulus(), options)->activeVoxelCount());
  const Vec3d voxels = cumulus().bounds().size() / options.voxel_size;
  state.SetItemsProcessed(int64_t(voxels.x * voxels.y * voxels.z) * state.iterations());
  state.counters["active"] =
      benchmark::Counter(double(active) * double(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(build)
    ->Name("cloud/build")
    ->ArgName("voxels")
    ->Arg(64)
    ->Arg(128)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// A cumulus whose bounding box has 512 voxels along each edge: what building is held to.
const ProceduralCloud& cube_of_cumulus() {
  static const ProceduralCloud cloud = [] {
    CloudRecipe recipe;
    recipe.noise.seed = 5;
    return ProceduralCloud(recipe, ellipsoid(Vec3d(0.0), Vec3d(1.0)));
  }();
  return cloud;
}
constexpr int kCubeEdge = 512;
constexpr double kCubeVoxelSize = 2.0 / kCubeEdge;

double fade(double t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}

double mixed(double a, double b, double t) {
  return a + t * (b - a);
}

double ramp(int hash, double x, double y, double z) {
  const int h = hash & 15;
  const double u = h < 8 ? x : y, v = h < 4 ? y : h == 12 || h == 14 ? x : z;
  return ((h & 1) == 0 ? u : -u) + ((h & 2) == 0 ? v : -v);
}

/// Improved noise as one writes it down, without derivatives: faster than PerlinNoise::value, which has them.
/// ref: perlin2002
double plain_noise(const NoiseTables& tables, const Vec3d& p) {
  const auto& hash = tables.hash;
  const Vec3d cell(std::floor(p.x), std::floor(p.y), std::floor(p.z));
  const size_t i = size_t(int(cell.x) & 255), j = size_t(int(cell.y) & 255), k = size_t(int(cell.z) & 255);
  const double x = p.x - cell.x, y = p.y - cell.y, z = p.z - cell.z;
  const double u = fade(x), v = fade(y), w = fade(z);
  const size_t a = hash[i] + j, b = hash[i + 1] + j;
  const size_t aa = hash[a] + k, ab = hash[a + 1] + k, ba = hash[b] + k, bb = hash[b + 1] + k;
  const auto row = [&](size_t from, size_t to, double dy, double dz, size_t next) {
    return mixed(ramp(hash[from + next], x, dy, dz), ramp(hash[to + next], x - 1, dy, dz), u);
  };
  const double near = mixed(row(aa, ba, y, z, 0), row(ab, bb, y - 1, z, 0), v);
  const double far = mixed(row(aa, ba, y, z - 1, 1), row(ab, bb, y - 1, z - 1, 1), v);
  return mixed(near, far, w);
}

/// What building replaces: the noise at every voxel of the box, one after the other, on one thread. Every 4th
/// layer of every 4th column is evaluated, so that it takes seconds; an item is a voxel.
void every_voxel(benchmark::State& state) {
  constexpr int kStride = 4;
  const CloudRecipe& recipe = cube_of_cumulus().recipe();
  const Fbm billows({recipe.noise.octaves, cube_of_cumulus().noise_frequency(), recipe.noise.lacunarity,
                     recipe.noise.gain, recipe.noise.seed});
  const CloudBody& form = cube_of_cumulus().shape().form();
  const CloudFormula formula(recipe);
  double sum = 0;
  int64_t voxels = 0;
  for (auto _ : state) {
    for (int x = 0; x < kCubeEdge; x += kStride) {
      for (int y = 0; y < kCubeEdge; y += kStride) {
        for (int z = 0; z < kCubeEdge; z += kStride, ++voxels) {
          const Vec3d p = Vec3d(x, y, z) * kCubeVoxelSize - Vec3d(1.0);
          double n = 0;
          for (const NoiseOctave& octave : billows.octaves())
            n += octave.amplitude *
                 std::fabs(plain_noise(billows.tables(), p * octave.frequency + octave.shift));
          n = std::min(1.0, n);
          sum += formula.density(formula.carved(formula.coverage(std::max(0.0, form.value(p))), n));
        }
      }
    }
  }
  benchmark::DoNotOptimize(sum);
  state.SetItemsProcessed(voxels);
}
BENCHMARK(every_voxel)->Name("cloud/every_voxel_scalar")->Unit(benchmark::kMillisecond)->UseRealTime();

/// The same cloud by build_cloud; an item is a voxel of the box. The argument is the number of threads.
void build_cube(benchmark::State& state) {
  initialize_openvdb();
  CloudGridOptions options;
  options.voxel_size = kCubeVoxelSize;
  CloudBuildCounters counters;
  int64_t active = 0, bytes = 0;
  for (auto _ : state) {
    with_threads(int(state.range(0)), [&] {
      const openvdb::FloatGrid::Ptr grid = build_cloud(cube_of_cumulus(), options, &counters);
      active = int64_t(grid->activeVoxelCount()), bytes = int64_t(grid->memUsage());
    });
  }
  state.SetItemsProcessed(counters.voxels * state.iterations());
  state.counters["empty_by_bound"] = double(counters.empty_by_bound) / double(counters.voxels - active);
  state.counters["noise_points"] = double(counters.noise_points) / double(counters.voxels);
  state.counters["active"] = double(active);
  state.counters["grid_bytes"] = double(bytes);
}
BENCHMARK(build_cube)
    ->Name("cloud/build_512")
    ->ArgName("threads")
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// The grid made into the field that integrators read; an item is an active voxel.
void field(benchmark::State& state) {
  initialize_openvdb();
  CloudGridOptions options;
  options.voxel_size = cumulus_voxel_size(int(state.range(0)));
  const openvdb::FloatGrid::Ptr grid = build_cloud(cumulus(), options);
  for (auto _ : state) benchmark::DoNotOptimize(field_from_grid(grid, Affine())->bricks());
  state.SetItemsProcessed(int64_t(grid->activeVoxelCount()) * state.iterations());
}
BENCHMARK(field)
    ->Name("cloud/field_from_grid")
    ->ArgName("voxels")
    ->Arg(128)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace pileus::bench
