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

TEST(Perlin, float_agrees_with_double) {
  const PerlinNoise noise;
  for (const Vec3d& p : random_points(100, 20000)) {
    const Vec3f p_float(p);
    ASSERT_NEAR(noise.value(p_float), noise.value(Vec3d(p_float)), 1.5e-5) << p_float;
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
  EXPECT_TRUE(std::isfinite(noise.value(Vec3f(3e38f, -3e38f, 0.5f))));
}

TEST(Perlin, seeds_differ_and_repeat) {
  const Vec3d p(0.3, 1.7, -2.2);
  EXPECT_EQ(PerlinNoise(7).value(p), PerlinNoise(7).value(p));
  EXPECT_NE(PerlinNoise(7).value(p), PerlinNoise(8).value(p));
  EXPECT_NE(PerlinNoise(7).value(p), PerlinNoise(0).value(p));
}

/// Largest value at a place of the cell over all gradients: each corner's ramp is at most the sum of the two
/// longest components of the way to it.
double highest_value(const Vec3d& place) {
  const auto fade = [](double t) { return t * t * t * (t * (t * 6 - 15) + 10); };
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0, total = 0.0, shortest = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double t = (corner >> axis & 1) ? 1 - place[axis] : place[axis];
      weight *= 1 - fade(t);
      total += t;
      shortest = std::min(shortest, t);
    }
    sum += weight * (total - shortest);
  }
  return sum;
}

/// Whether the whole cube stays below kPerlinBound. Along one axis highest_value changes by at most 1 (the
/// ramps) plus max fade'(t) |1 - 2t| < 0.54 (the weights) per unit.
bool cube_is_below_bound(const Vec3d& centre, double half_edge) {
  if (highest_value(centre) + 3 * 1.54 * half_edge <= kPerlinBound) return true;
  if (half_edge < 1e-5) return false;
  for (int child = 0; child < 8; ++child) {
    const Vec3d side(child & 1 ? 1 : -1, child & 2 ? 1 : -1, child & 4 ? 1 : -1);
    if (!cube_is_below_bound(centre + 0.5 * half_edge * side, 0.5 * half_edge)) return false;
  }
  return true;
}

TEST(PerlinBound, holds_for_every_choice_of_gradients) {
  // A proof by subdivision, in the corner octant of the cell: the other seven are its mirror images.
  EXPECT_TRUE(cube_is_below_bound(Vec3d(0.25), 0.25));
}

TEST(PerlinBound, is_tight) {
  EXPECT_GT(highest_value(Vec3d(0.5, 0.4825, 0.355)), kPerlinBound - 0.001);
}

}  // namespace
}  // namespace pileus
