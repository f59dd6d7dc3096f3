// The surface seen in other ways than as bilinear cells: bicubic, coarsened from afar; and that no ray slips
// through it, however it is seen. PILEUS_HUNT=100 looks for holes with a hundred times as many rays.
#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "lib/terrain/height_field.h"
#include "tests/fixtures/hunt.h"

namespace pileus {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

HeightTable rough_table(int columns, int rows, std::mt19937& random, double holes = 0.0) {
  HeightTable table{columns, rows, {}};
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int v = 0; v < rows; ++v) {
    for (int u = 0; u < columns; ++u) {
      const bool is_hole = unit(random) < 2.0 * holes - 1.0;
      const double z =
          4.0 * std::sin(0.11 * u) * std::cos(0.07 * v) + std::sin(0.5 * u + 0.3 * v) + 0.3 * unit(random);
      table.heights.push_back(is_hole ? std::nanf("") : float(z));
    }
  }
  return table;
}

Ray random_ray(const HeightTable& table, std::mt19937& random, double distance) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const Vec3d middle(0.5 * table.cells_x(), 0.5 * table.cells_y(), 0.0);
  const Vec3d target = middle + Vec3d(unit(random) * middle.x, unit(random) * middle.y, unit(random) * 4.0);
  const Vec3d from = normalize(Vec3d(unit(random), unit(random), 0.4 * unit(random))) * distance;
  return {target + from, normalize(-from)};
}

/// The slow twin: the first change of side among small steps, narrowed down.
double slow_hit(const HeightField& field, const Ray& ray, double length) {
  const auto side = [&](double t) {
    const Vec3d p = ray.at(t);
    const bool is_on_map =
        p.x >= 0.0 && p.y >= 0.0 && p.x <= field.table().cells_x() && p.y <= field.table().cells_y();
    const double z = is_on_map ? field.height(p.x, p.y) : std::nan("");
    return std::isnan(z) ? 0 : p.z > z ? 1 : -1;
  };
  constexpr int kSteps = 20000;
  int before = side(0.0);
  for (int k = 1; k <= kSteps; ++k) {
    double t0 = length * (k - 1) / kSteps, t1 = length * k / kSteps;
    const int here = side(t1);
    if (before * here >= 0) {
      before = here;
      continue;
    }
    for (int n = 0; n < 50; ++n) {
      const double t = 0.5 * (t0 + t1);
      (side(t) == before ? t0 : t1) = t;
    }
    return 0.5 * (t0 + t1);
  }
  return kInf;
}

TEST(BicubicField, agrees_with_small_steps) {
  std::mt19937 random(17);
  int hits = 0, missed_by_steps = 0;
  for (const double holes : {0.0, 0.05}) {
    const HeightTable table = rough_table(24, 17, random, holes);
    const HeightField field(table, HeightInterpolation::bicubic);
    for (int k = 0; k < 400; ++k) {
      const Ray ray = random_ray(table, random, 30.0);
      const auto hit = field.intersect(ray, {0.0, kInf}, -kInf);
      const double slow = slow_hit(field, ray, 70.0);
      if (hit) {
        ASSERT_NEAR(field.height(hit->u, hit->v), ray.at(hit->t).z, 1e-9);
      }
      if (hit && hit->t < slow - 1e-6) {  // through a crest thinner than a step
        ++missed_by_steps;
        continue;
      }
      ASSERT_EQ(hit.has_value(), std::isfinite(slow)) << k;
      if (!hit) continue;
      ++hits;
      ASSERT_NEAR(hit->t, slow, 1e-6) << k;
      const double step = 1e-5;
      if (hit->u < 1.0 || hit->v < 1.0 || hit->u > 22.0 || hit->v > 15.0) continue;
      ASSERT_NEAR(hit->du,
                  (field.height(hit->u + step, hit->v) - field.height(hit->u - step, hit->v)) / (2 * step),
                  holes > 0.0 ? kInf : 1e-3);
    }
  }
  EXPECT_GT(hits, 300);
  EXPECT_LT(missed_by_steps, 40);
}

TEST(Pyramid, knows_how_far_patches_deviate) {
  std::mt19937 random(19);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const auto interpolation : {HeightInterpolation::bilinear, HeightInterpolation::bicubic}) {
    for (const double holes : {0.0, 0.01}) {
      const HeightTable table = rough_table(70, 45, random, holes);
      const HeightField field(table, interpolation);
      const HeightPyramid pyramid(table, interpolation, true);
      double largest_share = 0.0;
      for (int k = 0; k < 60000; ++k) {
        const int level = 1 + k % pyramid.top();
        const double u = 69 * unit(random), v = 44 * unit(random);
        const int i = int(u) >> level, j = int(v) >> level;
        const int u0 = i << level, v0 = j << level;
        const int u1 = std::min((i + 1) << level, 69), v1 = std::min((j + 1) << level, 44);
        const double z = field.height(u, v),
                     patch = table.patch(level, i, j).at((u - u0) / (u1 - u0), (v - v0) / (v1 - v0));
        const double bound = pyramid.deviation(level, i, j);
        if (level <= HeightPyramid::kCoarsestPatch && !std::isnan(patch)) {
          ASSERT_EQ(pyramid.patch(level, i, j).at(0.3, 0.8), table.patch(level, i, j).at(0.3, 0.8));
        }
        if (std::isnan(z) || std::isnan(patch)) {
          ASSERT_EQ(bound, kInf);
          continue;
        }
        ASSERT_LE(std::abs(z - patch), bound + 1e-12) << level << " " << u << " " << v;
        if (level == 1 && bound > 0.0) largest_share = std::max(largest_share, std::abs(z - patch) / bound);
      }
      EXPECT_GT(largest_share, 0.5) << "no decoration";
    }
  }
}

double entry_to_map(const HeightTable& table, const Ray& ray) {
  double t = 0.0;
  const double size[2] = {double(table.cells_x()), double(table.cells_y())};
  for (int axis = 0; axis < 2; ++axis) {
    if (ray.o[axis] < 0.0) t = std::max(t, -ray.o[axis] / ray.d[axis]);
    if (ray.o[axis] > size[axis]) t = std::max(t, (size[axis] - ray.o[axis]) / ray.d[axis]);
  }
  return t;
}

/// What is seen coarsely lies as near to the surface as was asked, before it the ray is not behind the
/// surface, and the answer is the same bits where nearby rays have said how far it is clear.
TEST(CoarseField, keeps_to_the_deviation_that_is_allowed) {
  std::mt19937 random(23);
  int hits = 0, moved = 0, through = 0;
  for (const auto interpolation : {HeightInterpolation::bilinear, HeightInterpolation::bicubic}) {
    const HeightTable table = rough_table(150, 131, random, 0.0);
    const HeightField field(table, interpolation, true);
    for (int k = 0; k < 8000; ++k) {
      const Ray ray = random_ray(table, random, k % 2 == 0 ? 40.0 : 500.0);
      HeightSight sight{0.0, 0.05 * (k % 4), 0.0004};
      const auto hit = field.intersect(ray, {0.0, kInf}, -kInf, sight);
      Beam beam;
      for (int n = 0; n < 4; ++n) {
        beam.o.extendBy(ray.o);
        beam.d.extendBy(normalize(ray.d + 0.004 * Vec3d(n % 2, n / 2, n % 3 - 1)));
        beam.d.extendBy(ray.d);
      }
      sight.clear = field.clear_distance(beam);
      const auto same = field.intersect(ray, {0.0, kInf}, -kInf, sight);
      ASSERT_EQ(hit.has_value(), same.has_value()) << k;
      const auto exact = field.intersect(ray, {0.0, kInf}, -kInf);
      if (!hit) continue;
      ++hits;
      moved += exact && exact->t != hit->t;
      ASSERT_EQ(hit->t, same->t) << k;
      ASSERT_EQ(hit->du, same->du) << k;
      ASSERT_GE(hit->t, sight.clear) << k;
      const double allowed = sight.coarseness + hit->t * sight.coarsening;
      ASSERT_LE(hit->deviation, allowed + 1e-12);
      ASSERT_LE(std::abs(ray.at(hit->t).z - field.height(hit->u, hit->v)), allowed + 1e-9) << k;
      if (!exact || exact->t > hit->t) continue;
      const bool came_from_above = ray.d.z < exact->du * ray.d.x + exact->dv * ray.d.y;
      // Where a ray comes onto the map as near to the surface as that, it may come in on its other side.
      const Vec3d entry = ray.at(entry_to_map(table, ray));
      if (std::abs(entry.z - field.height(entry.x, entry.y)) <= allowed) continue;
      ++through;
      // It came through the surface before: then it stays near it until it is seen to.
      for (int n = 1; n < 8; ++n) {
        const Vec3d p = ray.at(lerp(exact->t, hit->t, n / 8.0));
        const double depth = came_from_above ? field.height(p.x, p.y) - p.z : p.z - field.height(p.x, p.y);
        ASSERT_LE(depth, allowed + 1e-9) << k;
      }
    }
  }
  EXPECT_GT(hits, 8000);
  EXPECT_GT(moved, 1000);
  EXPECT_GT(through, 1000);
}

struct Seen {
  std::string name;
  HeightInterpolation interpolation;
  double coarsening;
};

class Watertight : public testing::TestWithParam<Seen> {};

/// From above all of it to below all of it within the map: every such ray meets the surface. Through nodes,
/// along edges, along grid lines, at any slant, up to 1.5e5 cells from the origin.
TEST_P(Watertight, no_ray_slips_through) {
  std::mt19937 random(29);
  const HeightTable table = rough_table(257, 200, random);
  const HeightField field(table, GetParam().interpolation, GetParam().coarsening > 0.0);
  const double top = field.range().greatest + 0.1, bottom = field.range().least - 0.1;
  std::uniform_real_distribution<double> unit(-1.0, 1.0), across(40.0, 150.0);
  const int rays = hunted(40000);
  for (const double distance : {1.0, 1e3, 1.5e5}) {
    for (int k = 0; k < rays; ++k) {
      Vec3d target(across(random) + 20.0, across(random), 0.5 * (top + bottom));
      if (k % 2 == 0) target.x = std::floor(target.x);
      if (k % 3 == 0) target.y = std::floor(target.y);
      const double slant = std::pow(10.0, unit(random));
      Vec3d d(slant * unit(random), slant * unit(random), -1.0);
      if (k % 5 == 0) d.x = 0.0;
      if (k % 7 == 0) d.y = 0.0;
      if (k % 11 == 0) d.y = d.x;
      const double half = 0.5 * (top - bottom);
      if (std::max(std::abs(d.x), std::abs(d.y)) * half > 35.0) continue;
      const Ray ray{target - d * (half + distance), d};
      const HeightSight sight{0.0, GetParam().coarsening, 0.0};
      ASSERT_TRUE(field.intersect(ray, {0.0, kInf}, -kInf, sight)) << distance << " " << k;
      // The same the other way round, from below.
      const Ray back{target + d * (half + distance), -d};
      ASSERT_TRUE(field.intersect(back, {0.0, kInf}, -kInf, sight)) << distance << " " << k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Fields, Watertight,
                         testing::Values(Seen{"bilinear", HeightInterpolation::bilinear, 0.0},
                                         Seen{"bicubic", HeightInterpolation::bicubic, 0.0},
                                         Seen{"coarse", HeightInterpolation::bilinear, 0.2},
                                         Seen{"coarse_bicubic", HeightInterpolation::bicubic, 0.2}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace pileus
