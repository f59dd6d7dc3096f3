// Gradient noise and octave sums: what building a cloud spends its time on.
#include <vector>

#include <benchmark/benchmark.h>

#include "lib/noise/fbm.h"
#include "lib/noise/perlin.h"

namespace pileus::bench {
namespace {

/// Points along a line that crosses the lattice askew, a tenth of a cell apart, as neighbouring voxels are.
Vec3d point(int64_t i) {
  return Vec3d(0.0721, 0.0534, 0.0441) * double(i % 100'000);
}

void perlin(benchmark::State& state) {
  const PerlinNoise noise(5);
  int64_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(noise.value(point(i++)));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(perlin)->Name("noise/perlin");

FbmParams octaves(int64_t count) {
  FbmParams params;
  params.octaves = int(count);
  params.seed = 5;
  return params;
}

/// One point after the other, in double precision: the baseline.
void octave_sum(benchmark::State& state, OctaveSum kind) {
  const Fbm fbm(octaves(state.range(0)));
  int64_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(fbm.value(kind, point(i++)));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK_CAPTURE(octave_sum, fbm, OctaveSum::fbm)
    ->Name("noise/point/fbm")
    ->ArgName("octaves")
    ->Arg(1)
    ->Arg(6);

/// Leaves of 8^3 voxels; the second argument is thousandths of a lattice unit between voxels, in the first
/// octave.
void octave_sum_of_leaves(benchmark::State& state, OctaveSum kind) {
  const Fbm fbm(octaves(state.range(0)));
  NoiseBlock leaf{.origin = Vec3d(0), .spacing = 1e-3 * double(state.range(1)), .count = Vec3i(8, 8, 8)};
  std::vector<float> values(leaf.size());
  int64_t i = 0;
  for (auto _ : state) {
    leaf.origin = point(i++);
    fbm.evaluate(kind, leaf, values);
    benchmark::DoNotOptimize(values.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * int64_t(leaf.size()));
}
#define LEAVES(kind)                                             \
  BENCHMARK_CAPTURE(octave_sum_of_leaves, kind, OctaveSum::kind) \
      ->Name("noise/leaf/" #kind)                                \
      ->ArgNames({"octaves", "millicells"})
LEAVES(fbm)->ArgsProduct({{1, 6}, {4, 20, 100, 500, 1500}});
LEAVES(billow)->Args({6, 20});
LEAVES(ridged)->Args({6, 20});

}  // namespace
}  // namespace pileus::bench
