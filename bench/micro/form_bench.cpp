// Free forms: one point at a time, many at once, and bounds over boxes.
#include <array>
#include <cmath>
#include <vector>

#include <benchmark/benchmark.h>

#include "lib/freeform/form_program.h"
#include "lib/freeform/free_form.h"
#include "lib/freeform/local_form.h"
#include "lib/freeform/shapes.h"

namespace pileus::bench {
namespace {

/// An ellipsoid with bumps and dents all over it.
FreeForm bumpy(int bumps) {
  std::vector<Perturbation> perturbations;
  for (int i = 0; i < bumps; ++i) {
    const double angle = 2.4 * i, y = 1 - (2 * i + 1.0) / bumps, r = std::sqrt(1 - y * y);
    perturbations.push_back(
        {sphere({3 * r * std::cos(angle), y, 2 * r * std::sin(angle)}, 0.6), i % 3 == 0 ? -0.5 : 0.8});
  }
  return perturbed(ellipsoid({0, 0, 0}, {3, 1, 2}), perturbations);
}

/// Leaves of 8³ voxels along the surface.
Vec3d leaf_corner(int64_t i) {
  const double angle = 0.01 * double(i % 1000);
  return {3 * std::cos(angle), 0.05, 2 * std::sin(angle)};
}
constexpr double kVoxel = 0.02;

void value(benchmark::State& state) {
  const FreeForm form = bumpy(int(state.range(0)));
  int64_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(form.value(leaf_corner(i++)));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(value)->Name("form/value")->ArgName("bumps")->Arg(1)->Arg(30);

/// The whole of a leaf: what acts there, bounds, and 512 values.
void leaf(benchmark::State& state) {
  const FreeForm form = bumpy(int(state.range(0)));
  std::array<float, 512> f;
  int64_t i = 0;
  for (auto _ : state) {
    const PointLattice lattice{leaf_corner(i++), Vec3d(kVoxel), Vec3i(8)};
    form.within(lattice.box()).values(lattice, f);
    benchmark::DoNotOptimize(f);
  }
  state.SetItemsProcessed(state.iterations() * int64_t(f.size()));
}
BENCHMARK(leaf)->Name("form/leaf")->ArgName("bumps")->Arg(1)->Arg(30);

void range(benchmark::State& state) {
  const FreeForm form = bumpy(int(state.range(0)));
  int64_t i = 0;
  for (auto _ : state) {
    const Vec3d corner = leaf_corner(i++);
    benchmark::DoNotOptimize(form.range({corner, corner + Vec3d(7 * kVoxel)}));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(range)->Name("form/range")->ArgName("bumps")->Arg(1)->Arg(30);

}  // namespace
}  // namespace pileus::bench
