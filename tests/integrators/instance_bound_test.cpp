// The error bound of `march` for grids in several places.
#include <gtest/gtest.h>

#include "integrators/enclosed_world.h"
#include "tests/fixtures/bound_hunt.h"
#include "tests/fixtures/hunt.h"

namespace pileus {
namespace {

void add_instances(RandomWorld& random) {
  random.add_instances();
}
void add_instances_and_solids(RandomWorld& random) {
  random.add_instances();
  random.add_solids();
  if (random.chance(0.5)) random.add_fog();
}

/// The variation of the derivative of the optical depth along a step is at least what second differences of
/// exact depths show of it, wherever the places are.
TEST(InstanceBound, optical_depth_bends_no_more_than_told) {
  size_t bent = 0;
  for (unsigned seed = 0; seed < unsigned(hunted(150)); ++seed) {
    RandomWorld random(20000 + seed);
    if (random.world.lights.empty()) continue;
    random.add_instances();
    const MarchWorld march(random.world, random.plan);
    const EnclosedWorld enclosed(random.world, random.plan, march);
    FieldCounters counters;
    const DensityField& first = *random.world.media[0].density;
    const double scale = first.feature_size(), size = first.bounds().size().length();
    for (int n = 0; n < 60; ++n) {
      const Ray ray = random.ray();
      const Vec3d middle = ray.at(random.uniform(0.2, 1.2) * size);
      const Vec3d step = ray.d * (scale * random.logarithmic(0.01, 6.0));
      constexpr int kSteps = 24;
      std::array<double, kSteps + 1> depth;
      for (int i = 0; i <= kSteps; ++i)
        depth[size_t(i)] = enclosed.depth(0, middle + (double(i) / kSteps - 0.5) * step, counters);
      double variation = 0.0;
      for (size_t i = 1; i < kSteps; ++i)
        variation += kSteps * std::abs((depth[i + 1] - depth[i]) - (depth[i] - depth[i - 1]));
      const double bound = enclosed.depth_variation(0, middle, step);
      EXPECT_LE(variation, bound + 1e-9 * (1.0 + depth[0])) << "seed " << seed << ", line " << n;
      bent += variation > 1e-6;
    }
  }
  EXPECT_GT(bent, 500u);
}

TEST(InstanceBound, exact_radiance_lies_in_every_interval) {
  expect_radiance_in_every_interval(21000, size_t(hunted(50)), add_instances);
}

TEST(InstanceBound, exact_radiance_among_solids_lies_in_every_interval) {
  expect_radiance_in_every_interval(22000, size_t(hunted(30)), add_instances_and_solids);
}

TEST(InstanceBound, no_ray_errs_by_more) {
  const std::vector<double> ratios = expect_no_ray_errs_by_more(23000, size_t(hunted(40)), add_instances);
  EXPECT_GT(ratios.size(), 200u);
  EXPECT_LT(median(ratios), 4.0);
}

}  // namespace
}  // namespace pileus
