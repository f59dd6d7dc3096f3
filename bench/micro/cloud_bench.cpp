// Building a procedural cloud into a grid, on all cores.
#include <benchmark/benchmark.h>

#include "bench/micro/fixtures.h"
#include "vdb_io/build_cloud.h"
#include "vdb_io/grid_to_field.h"
#include "vdb_io/openvdb_library.h"

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
