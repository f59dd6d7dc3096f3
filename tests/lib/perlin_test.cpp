#include "lib/noise/perlin.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/reference/perlin_reference.h"

namespace pileus {
namespace {

std::vector<Vec3d> random_points(double reach, int count) {
  std::mt19937_64 random(2002);
  std::uniform_real_distribution<double> coordinate(-reach, reach);
  std::vector<Vec3d> points;
  for (int i = 0; i < count; ++i) {
    points.emplace_back(coordinate(random), coordinate(random), coordinate(random));
  }
  return points;
}

TEST(Perlin, gives_the_published_value) {
  // The example that every port of the reference implementation quotes.
  EXPECT_DOUBLE_EQ(PerlinNoise().value(Vec3d(3.14, 42, 7)), 0.13691995878400012);
}

TEST(Perlin, value_computed_by_hand) {
  // On the edge from (0,0,0) to (1,0,0) only its two ends count. Their hashes are p[p[p[0]]] = 36, gradient
  // (1,0,1), and p[p[p[1]]] = 86, gradient (1,0,-1): ramps 1/4 and -3/4, mixed by fade(1/4) = 53/512.
  EXPECT_EQ(PerlinNoise().value(Vec3d(0.25, 0, 0)), 0.25 - 53.0 / 512.0);
}

TEST(Perlin, agrees_with_the_slow_twin) {
  const PerlinNoise noise;
  const reference::SlowPerlin slow;
  for (const Vec3d& p : random_points(1000, 20000)) {
    ASSERT_NEAR(noise.value(p), slow.value(p.x, p.y, p.z), 1e-14) << p;
  }
}

TEST(Perlin, gradient_at_lattice_points_is_the_published_one) {
  const PerlinNoise noise;
  const reference::SlowPerlin slow;
  for (const Vec3d& p : random_points(1e6, 1000)) {
    const Vec3d corner(std::floor(p.x), std::floor(p.y), std::floor(p.z));
    EXPECT_EQ(noise.sample(corner).gradient, slow.corner_gradient(corner.x, corner.y, corner.z)) << corner;
  }
}

TEST(Perlin, gradient_agrees_with_differences) {
  const PerlinNoise noise(3);
  const double step = 1e-5;
  for (const Vec3d& p : random_points(300, 2000)) {
    const NoiseSample sample = noise.sample(p);
    EXPECT_EQ(sample.value, noise.value(p));
    for (int axis = 0; axis < 3; ++axis) {
      Vec3d before = p, after = p;
      before[axis] -= step, after[axis] += step;
      const double difference = (noise.value(after) - noise.value(before)) / (after[axis] - before[axis]);
      ASSERT_NEAR(sample.gradient[axis], difference, 1e-7) << p << " axis " << axis;
    }
  }
}

TEST(Perlin, is_zero_on_the_lattice) {
  const PerlinNoise noise(3);
  for (const Vec3d& p : random_points(1e6, 1000)) {
    EXPECT_EQ(noise.value(Vec3d(std::floor(p.x), std::floor(p.y), std::floor(p.z))), 0.0);
  }
}

TEST(Perlin, has_period_256_also_at_negative_coordinates) {
  const PerlinNoise noise;
  for (const Vec3d& p : random_points(8, 1000)) {
    const Vec3d exact(std::round(p.x * 1024) / 1024, std::round(p.y * 1024) / 1024,
                      std::round(p.z * 1024) / 1024);
    EXPECT_EQ(noise.value(exact), noise.value(exact + Vec3d(256, -512, 256 * 4096.0)));
  }
}

TEST(Perlin, is_continuous_across_cell_borders_and_zero) {
  const PerlinNoise noise;
  for (const double x : {-256.0, -1.0, 0.0, 1.0, 255.0, 256.0}) {
    const Vec3d before(std::nextafter(x, -1e9), 0.3, -0.6), after(x, 0.3, -0.6);
    EXPECT_NEAR(noise.value(before), noise.value(after), 1e-12) << x;
  }
  EXPECT_NEAR(noise.value(Vec3d(-1e-300, 0.3, 0.6)), noise.value(Vec3d(0.0, 0.3, 0.6)), 1e-15);
}

TEST(Perlin, is_defined_at_huge_coordinates) {
  const PerlinNoise noise;
  for (const double huge : {1e10, 4294967295.5, 9.3e18, 1e300, -1e10, -1e300}) {
    const double value = noise.value(Vec3d(huge, -huge, 0.5));
    EXPECT_TRUE(std::isfinite(value)) << huge;
    EXPECT_LE(std::fabs(value), kPerlinBound);
  }
}

TEST(Perlin, repeats_after_its_period) {
  const PerlinNoise noise(1);
  const NoiseVariant variant{.period = Vec3i(3, 300, 1)};
  for (const Vec3d& p : random_points(8, 1000)) {
    const Vec3d exact(std::round(p.x * 1024) / 1024, std::round(p.y * 1024) / 1024,
                      std::round(p.z * 1024) / 1024);
    EXPECT_EQ(noise.value(exact, variant), noise.value(exact + Vec3d(3, -600, 5), variant));
  }
  // In the middle of a period nothing changes.
  EXPECT_EQ(noise.value(Vec3d(1.5, 7.25, 0), {.period = Vec3i(3, 300, 2)}), noise.value(Vec3d(1.5, 7.25, 0)));
}

TEST(Perlin, a_whole_turn_changes_nothing) {
  const PerlinNoise noise;
  for (const Vec3d& p : random_points(100, 300)) {
    EXPECT_EQ(noise.value(p, {.turn = noise_turn(7)}), noise.value(p));
    EXPECT_NE(noise.value(p, {.turn = noise_turn(0.25)}), noise.value(p));
  }
}

TEST(Perlin, gradients_turn_in_their_hull_at_even_speed) {
  const PerlinNoise noise;
  for (const Vec3d& p : random_points(1e4, 300)) {
    const Vec3d corner(std::floor(p.x), std::floor(p.y), std::floor(p.z));
    const auto gradient = [&](double turn) {
      return noise.sample(corner, {.turn = noise_turn(turn)}).gradient;
    };
    for (int step = 0; step < 60; ++step) {
      const Vec3d g = gradient(step / 60.0), next = gradient((step + 1) / 60.0);
      const Vec3d size(std::fabs(g.x), std::fabs(g.y), std::fabs(g.z));
      ASSERT_LE(std::max({size.x, size.y, size.z}), 1 + 1e-6);
      ASSERT_LE(size.x + size.y + size.z, 2 + 1e-6);
      ASSERT_GE(length(g), std::sqrt(1.5) - 1e-6) << "contrast is lost";
      ASSERT_NEAR(length(next - g), std::sqrt(2.0) / 10, 1e-6);
    }
    ASSERT_NEAR(length(gradient(0.5) + gradient(0)), 0, 1e-6) << "half a turn reverses";
  }
}

TEST(Perlin, seeds_differ_and_repeat) {
  const Vec3d p(0.3, 1.7, -2.2);
  EXPECT_EQ(PerlinNoise(7).value(p), PerlinNoise(7).value(p));
  EXPECT_NE(PerlinNoise(7).value(p), PerlinNoise(8).value(p));
  EXPECT_NE(PerlinNoise(7).value(p), PerlinNoise(0).value(p));
}

}  // namespace
}  // namespace pileus
