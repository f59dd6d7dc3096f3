// Gradient noise and octave sums: what building a cloud spends its time on.
#include <benchmark/benchmark.h>

#include "lib/noise/fbm.h"
#include "lib/noise/perlin.h"

namespace pileus::bench {
namespace {

/// Points along a line that crosses the lattice askew, a tenth of a cell apart, as neighbouring voxels are.
Vec3d point(int64_t i) {
  return Vec3d(0.0721, 0.0534, 0.0441) * double(i % 100'000);
}

template <class Real>
void perlin(benchmark::State& state) {
  const PerlinNoise noise(5);
  int64_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(noise.value(Imath::Vec3<Real>(point(i++))));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(perlin<double>)->Name("noise/perlin/double");
BENCHMARK(perlin<float>)->Name("noise/perlin/float");

void octave_sum(benchmark::State& state, double (Fbm::*value)(const Vec3d&) const) {
  FbmParams params;
  params.octaves = int(state.range(0));
  params.seed = 5;
  const Fbm fbm(params);
  int64_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize((fbm.*value)(point(i++)));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK_CAPTURE(octave_sum, value, &Fbm::value)->Name("noise/fbm")->ArgName("octaves")->Arg(1)->Arg(6);
BENCHMARK_CAPTURE(octave_sum, billow, &Fbm::billow)->Name("noise/billow")->ArgName("octaves")->Arg(1)->Arg(6);

}  // namespace
}  // namespace pileus::bench
