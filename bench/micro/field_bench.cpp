// What the exact and the uniform integrator ask of a density field.
#include <limits>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/micro/fixtures.h"

namespace pileus::bench {
namespace {

constexpr int kPixels = 64;
constexpr Segment kWholeRay{0.0, std::numeric_limits<double>::infinity()};

/// Optical depth in closed form; an item is a cell whose corners are read.
void exact_column(benchmark::State& state) {
  const auto field = cumulus_field(int(state.range(0)));
  const std::vector<Ray> rays = camera_rays(field->bounds(), kPixels);
  FieldCounters counters;
  for (auto _ : state) {
    for (const Ray& ray : rays) {
      benchmark::DoNotOptimize(
          field->column(ray, kWholeRay, std::numeric_limits<double>::infinity(), counters));
    }
  }
  state.SetItemsProcessed(int64_t(counters.density_samples));
  state.counters["rays"] =
      benchmark::Counter(double(rays.size()) * double(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(exact_column)
    ->Name("field/exact_column")
    ->ArgName("voxels")
    ->Arg(64)
    ->Arg(256)
    ->Unit(benchmark::kMillisecond);

/// The cubic pieces of the density along a ray; an item is a cell.
void exact_pieces(benchmark::State& state) {
  const auto field = cumulus_field(int(state.range(0)));
  const std::vector<Ray> rays = camera_rays(field->bounds(), kPixels);
  FieldCounters counters;
  std::vector<DensityPiece> pieces;
  for (auto _ : state) {
    for (const Ray& ray : rays) {
      pieces.clear();
      field->append_pieces(ray, kWholeRay, pieces, counters);
      benchmark::DoNotOptimize(pieces.data());
    }
  }
  state.SetItemsProcessed(int64_t(counters.density_samples));
}
BENCHMARK(exact_pieces)
    ->Name("field/exact_pieces")
    ->ArgName("voxels")
    ->Arg(256)
    ->Unit(benchmark::kMillisecond);

/// Equidistant look-ups, one a voxel; an item is a look-up, empty space included.
void equidistant_samples(benchmark::State& state) {
  const auto field = cumulus_field(int(state.range(0)));
  const Box3d box = field->bounds();
  const std::vector<Ray> rays = camera_rays(box, kPixels);
  const double reach = length(box.size()), start = length(rays.front().o - box.center()) - 0.5 * reach;
  std::vector<double> rho(size_t(reach / field->feature_size()));
  FieldCounters counters;
  for (auto _ : state) {
    for (const Ray& ray : rays) {
      field->sample(ray, start, field->feature_size(), rho, counters);
      benchmark::DoNotOptimize(rho.data());
    }
  }
  state.SetItemsProcessed(int64_t(rho.size() * rays.size()) * state.iterations());
}
BENCHMARK(equidistant_samples)
    ->Name("field/samples")
    ->ArgName("voxels")
    ->Arg(256)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pileus::bench
