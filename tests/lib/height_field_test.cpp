#include "lib/terrain/height_field.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace pileus {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

HeightTable random_table(int columns, int rows, std::mt19937& random, double holes = 0.0) {
  HeightTable table{columns, rows, {}};
  std::uniform_real_distribution<float> height(0.0F, 3.0F);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  for (int k = 0; k < columns * rows; ++k) {
    table.heights.push_back(chance(random) < holes ? std::nanf("") : height(random));
  }
  return table;
}

/// From a sphere around the map to a point above it.
Ray random_ray(const HeightTable& table, std::mt19937& random, double distance) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const Vec3d middle(0.5 * table.cells_x(), 0.5 * table.cells_y(), 1.5);
  const Vec3d target = middle + Vec3d(unit(random) * middle.x, unit(random) * middle.y, unit(random) * 1.5);
  const Vec3d from = normalize(Vec3d(unit(random), unit(random), unit(random))) * distance;
  return {target + from, normalize(-from)};
}

/// The slow twin: every cell, its quadratic by the textbook in long double.
double slow_hit(const HeightTable& table, const Ray& ray) {
  long double nearest = kInf;
  for (int j = 0; j < table.cells_y(); ++j) {
    for (int i = 0; i < table.cells_x(); ++i) {
      const Patch<double> p = table.patch(i, j);
      if (!p.has_data()) continue;
      const long double b = p.z10 - p.z00, c = p.z01 - p.z00,
                        d = (long double)(p.z11) - p.z10 - p.z01 + p.z00;
      const long double ou = (long double)(ray.o.x) - i, ov = (long double)(ray.o.y) - j;
      const long double du = ray.d.x, dv = ray.d.y;
      const long double q2 = d * du * dv, q1 = b * du + c * dv + d * (ou * dv + ov * du) - ray.d.z;
      const long double q0 = p.z00 + b * ou + c * ov + d * ou * ov - ray.o.z;
      const long double disc = q1 * q1 - 4 * q2 * q0;
      if (disc < 0) continue;
      const long double q = -0.5L * (q1 + std::copysign(std::sqrt(disc), q1));
      for (const long double t : {q / q2, q0 / q}) {
        const long double u = ou + t * du, v = ov + t * dv;
        if (t > 0 && u >= 0 && u <= 1 && v >= 0 && v <= 1) nearest = std::min(nearest, t);
      }
    }
  }
  return double(nearest);
}

TEST(HeightField, agrees_with_a_search_of_every_cell) {
  std::mt19937 random(7);
  int hits = 0;
  for (const double holes : {0.0, 0.1}) {
    const HeightTable table = random_table(14, 9, random, holes);
    const HeightField field(table);
    for (int k = 0; k < 20000; ++k) {
      const Ray ray = random_ray(table, random, 30.0);
      const auto hit = field.intersect(ray, {0.0, kInf}, -kInf);
      const double slow = slow_hit(table, ray);
      ASSERT_EQ(hit.has_value(), std::isfinite(slow)) << k;
      if (!hit) continue;
      ++hits;
      ASSERT_NEAR(hit->t, slow, 1e-6) << k;
      ASSERT_NEAR(field.height(hit->u, hit->v), ray.at(hit->t).z, 1e-12);
    }
  }
  EXPECT_GT(hits, 10000);
}

/// From above to below inside the map there is a hit, however the ray runs: through nodes, along edges.
TEST(HeightField, has_no_cracks_at_any_distance) {
  std::mt19937 random(3);
  const HeightTable table = random_table(34, 21, random);
  const HeightField field(table);
  std::uniform_int_distribution<int> column(1, 32), row(1, 19);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (const double distance : {1.0, 1e3, 1.5e5}) {
    for (int k = 0; k < 60000; ++k) {
      Vec3d target(column(random), row(random), 0.0);
      if (k % 3 != 0) target.x += 0.5 * unit(random);  // on an edge
      target.z = field.height(target.x, target.y);
      Vec3d d(0.2 * unit(random), 0.2 * unit(random), -1.0);
      if (k % 5 == 0) d.x = 0.0;
      if (k % 7 == 0) d.y = 0.0;
      // Through the map's inside from over its top to under its bottom.
      const double up = std::min(distance, 4.0);
      const Ray ray{target - d * (distance > 4.0 ? distance : up), d};
      const double t0 = distance > 4.0 ? distance : up;
      const double before = (target.z - 3.1) / 1.0 + 0.0, after = target.z + 0.1;
      ASSERT_TRUE(field.intersect(ray, {std::max(0.0, t0 + before), t0 + after}, -kInf))
          << distance << " " << k;
    }
  }
}

/// Rays from near one point in nearly one direction.
std::vector<Ray> neighbours(const HeightTable& table, std::mt19937& random, double spread) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const Ray middle = random_ray(table, random, std::exp(1.0 + 2.0 * unit(random)));
  std::vector<Ray> rays;
  for (int k = 0; k < 16; ++k) {
    const Vec3d aside(unit(random), unit(random), unit(random));
    rays.push_back({middle.o, normalize(middle.d + spread * aside)});
  }
  return rays;
}

TEST(HeightField, nothing_stands_where_a_beam_is_clear) {
  std::mt19937 random(11);
  int late = 0, never = 0, hits = 0;
  for (const double holes : {0.0, 0.05}) {
    const HeightTable table = random_table(60, 41, random, holes);
    const HeightField field(table);
    for (int k = 0; k < 6000; ++k) {
      const std::vector<Ray> rays = neighbours(table, random, k % 2 == 0 ? 0.003 : 0.1);
      Beam beam;
      for (const Ray& ray : rays) beam.o.extendBy(ray.o), beam.d.extendBy(ray.d);
      const double clear = field.clear_distance(beam);
      late += clear > 0.0 && std::isfinite(clear), never += std::isinf(clear);
      for (const Ray& ray : rays) {
        const auto hit = field.intersect(ray, {0.0, kInf}, -kInf);
        const auto same = field.intersect(ray, {0.0, kInf}, -kInf,
                                          {.clear = clear, .spacing = k % 3 * 0.1, .spreading = k % 5 * 0.7});
        ASSERT_EQ(hit.has_value(), same.has_value()) << k;
        if (!hit) continue;
        ++hits;
        ASSERT_GE(hit->t, clear) << k;
        ASSERT_EQ(hit->t, same->t) << "the same bits";
        ASSERT_EQ(hit->u, same->u);
        ASSERT_EQ(hit->z, same->z);
      }
    }
  }
  EXPECT_GT(late, 3000);
  EXPECT_GT(never, 20);
  EXPECT_GT(hits, 50000);
}

TEST(HeightField, bounds_between_two_points_hold) {
  std::mt19937 random(13);
  const HeightTable table = random_table(45, 70, random);
  const HeightField field(table);
  const HeightPyramid pyramid(table);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int k = 0; k < 3000; ++k) {
    const double u0 = 44 * unit(random), v0 = 69 * unit(random), size = 20 * unit(random) * unit(random);
    const HeightRange range = pyramid.between(u0, v0, u0 + size, v0 + 0.5 * size);
    for (int n = 0; n < 20; ++n) {
      const double z = field.height(u0 + size * unit(random), v0 + 0.5 * size * unit(random));
      ASSERT_GE(z, range.least);
      ASSERT_LE(z, range.greatest);
    }
  }
}

TEST(HeightField, bounds_hold_over_shared_nodes_and_leave_out_holes) {
  std::mt19937 random(5);
  const HeightTable table = random_table(19, 13, random, 0.2);
  const HeightPyramid pyramid(table);
  for (int level = 1; level <= pyramid.top(); ++level) {
    for (int j = 0; j < table.cells_y(); ++j) {
      for (int i = 0; i < table.cells_x(); ++i) {
        const Patch<double> p = table.patch(i, j);
        if (!p.has_data()) continue;
        const HeightRange& range = pyramid.at(level, i >> level, j >> level);
        for (const double z : {p.z00, p.z10, p.z01, p.z11}) {
          ASSERT_LE(range.least, z);
          ASSERT_GE(range.greatest, z);
        }
      }
    }
  }
  EXPECT_TRUE(HeightPyramid({2, 2, {std::nanf(""), 1, 1, 1}}).all().empty());
}

TEST(HeightField, keeps_to_the_segment_and_the_lowest_height) {
  const HeightField ridge(HeightTable{3, 2, {0, 2, 0, 0, 2, 0}});
  const Ray ray{{-1, 0.5, 1}, {1, 0, 0}};
  EXPECT_DOUBLE_EQ(ridge.intersect(ray, {0.0, kInf}, -kInf)->t, 1.5);
  EXPECT_DOUBLE_EQ(ridge.intersect(ray, {1.5, kInf}, -kInf)->t, 2.5);
  EXPECT_FALSE(ridge.intersect(ray, {0.0, 1.5}, -kInf));
  EXPECT_FALSE(ridge.intersect(ray, {0.0, kInf}, 1.25));
  EXPECT_TRUE(ridge.intersect({{0.75, 0.5, 9}, {0, 0, -1}}, {0.0, kInf}, 1.25));
  EXPECT_FALSE(ridge.intersect({{0.25, 0.5, 9}, {0, 0, -1}}, {0.0, kInf}, 1.25));
}

}  // namespace
}  // namespace pileus
