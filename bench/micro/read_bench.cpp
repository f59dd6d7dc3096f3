// Bricks for marching: how long they take to build, and to read along rays.
#include <algorithm>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/micro/fixtures.h"
#include "bench/micro/kernels/read_kernel.h"
#include "lib/volume/brick_grid.h"
#include "lib/volume/quantized_bricks.h"
#include "vdb_io/openvdb/build_cloud.h"
#include "vdb_io/openvdb/grid_to_field.h"
#include "vdb_io/openvdb/openvdb_library.h"

namespace pileus::bench {
namespace {

/// From the grid to bricks of a kind, on all cores; the first argument is 0 for floats, 1 for 16 bits.
void build(benchmark::State& state) {
  initialize_openvdb();
  CloudGridOptions options;
  options.voxel_size = cumulus_voxel_size(256);
  const openvdb::FloatGrid::ConstPtr grid = build_cloud(cumulus(), options);
  for (auto _ : state) {
    const auto field = field_from_grid(grid, Affine());
    if (state.range(0) == 1) {
      benchmark::DoNotOptimize(field->quantized_bricks());
    } else {
      benchmark::DoNotOptimize(BrickPyramid(*field->bricks()));
    }
  }
  state.SetItemsProcessed(int64_t(grid->activeVoxelCount()) * state.iterations());
}
BENCHMARK(build)
    ->Name("bricks/build")
    ->ArgName("16-bit")
    ->Arg(0)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// Positions of packets of sixteen neighbouring rays, packet after packet, step by step, inside a box of
/// cells.
struct RayPositions {
  RayPositions(const Vec3d& lo, const Vec3d& hi) {
    constexpr double kApart = 0.4, kStep = 0.9;  // [cells]
    constexpr int kSide = 4;
    for (double y0 = lo.y; y0 + kSide * kApart < hi.y; y0 += kSide * kApart) {
      for (double z0 = lo.z; z0 + kSide * kApart < hi.z; z0 += kSide * kApart) {
        for (double x0 = lo.x; x0 < hi.x; x0 += kStep) {
          for (int i = 0; i < kSide * kSide; ++i) {
            x.push_back(float(x0 + 0.01 * i));
            y.push_back(float(y0 + kApart * (i / kSide)));
            z.push_back(float(z0 + kApart * (i % kSide)));
          }
        }
        if (x.size() > kMost) return;
      }
    }
  }

  static constexpr size_t kMost = 1 << 22;
  std::vector<float> x, y, z;
};

/// An item is a look-up; the second argument is the edge of the cube that is read [cells]: one brick stays in
/// the first cache, four bricks in the second, and the whole cloud in none.
void read(benchmark::State& state) {
  const auto field = cumulus_field(256);
  const BrickPyramid pyramid =
      state.range(0) == 1 ? *field->quantized_bricks() : BrickPyramid(*field->bricks());
  const Vec3d center = 0.5 * Vec3d(pyramid.lo() + pyramid.hi()) - Vec3d(pyramid.origin());
  Vec3d half;
  for (int axis = 0; axis < 3; ++axis)
    half[axis] = 0.5 * std::min<double>(double(state.range(1)), pyramid.hi()[axis] - pyramid.lo()[axis]);
  const RayPositions at(center - half, center + half);
  for (auto _ : state) benchmark::DoNotOptimize(sum_densities(pyramid, {at.x, at.y, at.z}));
  state.SetItemsProcessed(int64_t(at.x.size()) * state.iterations());
}
BENCHMARK(read)->Name("bricks/read")->ArgNames({"16-bit", "cells"})->ArgsProduct({{0, 1}, {8, 32, 256}});

}  // namespace
}  // namespace pileus::bench
