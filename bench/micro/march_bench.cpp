// What `march` is made of: bricks, their pyramid, the sun's lattice, and rays through all of it.
#include <limits>

#include <benchmark/benchmark.h>

#include "bench/micro/fixtures.h"
#include "integrators/kernels/sun_kernel.h"
#include "integrators/sun_lattice.h"
#include "lib/core/parallel.h"

namespace pileus::bench {
namespace {

/// The cumulus as the kernels see it, without lights.
struct MarchFixture {
  explicit MarchFixture(int voxels) : field(cumulus_field(voxels)), pyramid(*field->quantized_bricks()) {
    const Vec3d origin(pyramid.origin());
    grid.pyramid = &pyramid;
    grid.local_from_world = Affine::translation(-origin) * field->index_from_world();
    grid.bounds = Box3d(Vec3d(pyramid.lo()) - origin, Vec3d(pyramid.hi()) - origin);
    grid.extinction = 16.0;
  }

  std::shared_ptr<const DensityField> field;
  BrickPyramid pyramid;
  MarchGrid grid;
};

const Vec3d kSun = normalize(Vec3d(-0.7, 0.6, 0.5));

void BM_brick_pyramid(benchmark::State& state) {
  const auto field = cumulus_field(int(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(BrickPyramid(*field->bricks()));
}
BENCHMARK(BM_brick_pyramid)->Arg(256)->Unit(benchmark::kMillisecond);

/// One thread; arguments: spacing across and along the light in tenths of a voxel.
void BM_sun_lattice(benchmark::State& state) {
  const MarchFixture fixture(256);
  LatticeOptions options;
  options.spacing = {double(state.range(0)) / 10.0, double(state.range(1)) / 10.0};
  options.is_everywhere = false;
  uint64_t samples = 0;
  double bytes = 0.0;
  with_threads(1, [&] {
    for (auto _ : state)
      bytes = double(build_sun_lattice(fixture.grid, kSun, options, &samples).memory_bytes());
  });
  state.counters["samples"] = benchmark::Counter(double(samples), benchmark::Counter::kIsRate);
  state.counters["samples_each"] = benchmark::Counter(double(samples), benchmark::Counter::kAvgIterations);
  state.counters["bytes"] = bytes;
}
BENCHMARK(BM_sun_lattice)
    ->Args({10, 20})
    ->Args({20, 40})
    ->Args({40, 80})
    ->Args({80, 160})
    ->Unit(benchmark::kMillisecond);

/// Single columns towards the sun, by steps of half a voxel.
void BM_sun_column(benchmark::State& state) {
  const MarchFixture fixture(256);
  const Vec3d towards = fixture.grid.local_from_world.direction(kSun);
  const Box3d& box = fixture.grid.bounds;
  int n = 0;
  for (auto _ : state) {
    const Vec3d share((n * 7 % 13 + 0.5) / 13, (n * 5 % 11 + 0.5) / 11, (n * 3 % 17 + 0.5) / 17);
    benchmark::DoNotOptimize(
        stepped_column(fixture.grid, {box.min + share * box.size(), towards}, 0.5 / length(towards)));
    ++n;
  }
}
BENCHMARK(BM_sun_column)->Unit(benchmark::kMicrosecond);

/// Rays through the cloud on one thread; arguments: 1000 * step quality, lights.
void BM_march(benchmark::State& state) {
  const MarchFixture fixture(256);
  MarchScene scene;
  scene.grids.push_back(fixture.grid);
  scene.lights = int(state.range(1));
  for (int l = 0; l < scene.lights; ++l)
    scene.lattices.push_back(build_sun_lattice(fixture.grid, kSun, {{2.0, 4.0}}));
  const std::vector<float> weights(size_t(kMostTerms * std::max(1, scene.lights)), 1.0f);
  std::vector<MarchRay> jobs;
  for (const Ray& ray : camera_rays(fixture.field->bounds(), 384)) {
    MarchRay job;
    job.ray = ray;
    job.segment = {0.0, std::numeric_limits<double>::infinity()};
    job.weights = weights.data();
    job.stop = 1e-4;
    job.brightest = 1.0;
    job.step_quality = double(state.range(0)) / 1000.0;
    jobs.push_back(job);
  }
  std::vector<MarchResult> results(jobs.size());
  std::vector<double> sums(jobs.size() * scene.media() * sums_per_medium(scene));
  uint64_t samples = 0, leaps = 0;
  for (auto _ : state) {
    march_rays(scene, jobs, results, sums);
    for (const MarchResult& result : results) samples += result.samples, leaps += result.leaps;
  }
  state.counters["samples"] = benchmark::Counter(double(samples), benchmark::Counter::kIsRate);
  state.counters["leaps"] = benchmark::Counter(double(leaps), benchmark::Counter::kIsRate);
  state.counters["rays"] =
      benchmark::Counter(double(jobs.size() * state.iterations()), benchmark::Counter::kIsRate);
  state.SetLabel(march_target());
}
BENCHMARK(BM_march)->ArgsProduct({{1000, 100, 10}, {0, 1}})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pileus::bench
