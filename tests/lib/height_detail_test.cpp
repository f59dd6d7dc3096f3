// The surface seen in other ways than as bilinear cells: bicubic, coarsened from afar; and that no ray slips
// through it, however it is seen. PILEUS_HUNT=100 looks for holes with a hundred times as many rays.
#include <array>
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

/// Where a map point lies in a block of a level.
struct InBlock {
  int i, j;
  double s, r;
};

InBlock in_block(const HeightTable& table, int level, double u, double v) {
  const int i = int(u) >> level, j = int(v) >> level, u0 = i << level, v0 = j << level;
  const int u1 = std::min((i + 1) << level, table.cells_x()),
            v1 = std::min((j + 1) << level, table.cells_y());
  return {i, j, (u - u0) / (u1 - u0), (v - v0) / (v1 - v0)};
}

float highest(const HeightTable& table) {
  float highest = 0.0F;
  for (const float z : table.heights) highest = std::max(highest, std::isnan(z) ? 0.0F : std::abs(z));
  return highest;
}

/// At random points and at nodes, where bilinear patches deviate most.
TEST(CoarsePatches, know_how_far_they_deviate) {
  constexpr int kUnit = CoarsePatches::kUnit, kCoarsest = CoarsePatches::kCoarsest;
  std::mt19937 random(19);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const auto interpolation : {HeightInterpolation::bilinear, HeightInterpolation::bicubic}) {
    for (const double holes : {0.0, 0.003}) {
      const HeightTable table = rough_table(1100, 45, random, holes);
      const HeightField field(table, interpolation);
      const CoarsePatches patches(table, interpolation, highest(table));
      std::array<double, kCoarsest + 1> largest_share{};
      int holed = 0;
      for (int k = 0; k < hunted(400000); ++k) {
        const int level = 1 + k % kCoarsest, of_block = std::max(level, kUnit);
        double u = 1099 * unit(random), v = 44 * unit(random);
        if (k % 2 == 0) u = std::floor(u), v = std::floor(v);
        const InBlock here = in_block(table, level, u, v);
        const int i = int(u) >> of_block, j = int(v) >> of_block;
        const double z = field.height(u, v), patch = table.patch(level, here.i, here.j).at(here.s, here.r);
        const double bound = patches.deviation(level, i, j);
        ASSERT_EQ(patches.patch(level, here.i, here.j).at(0.3, 0.8) ==
                      table.patch(level, here.i, here.j).at(0.3, 0.8),
                  !std::isnan(patch));
        if (level > 1 && level <= kUnit) {
          ASSERT_LE(patches.deviation(level - 1, i, j), bound);
        }
        if (std::isnan(z) || std::isnan(patch)) {
          ++holed;
          ASSERT_EQ(bound, kInf);
          continue;
        }
        ASSERT_LE(std::abs(z - patch), bound) << level << " " << u << " " << v;
        double& share = largest_share[size_t(level)];
        share = std::max(share, std::abs(z - patch) / bound);
      }
      for (int level = 1; level <= kCoarsest; ++level)
        EXPECT_GT(largest_share[size_t(level)], interpolation == HeightInterpolation::bilinear ? 0.98 : 0.5)
            << "no decoration: " << level;
      EXPECT_EQ(holed > 100, holes > 0.0);
    }
  }
}

TEST(CoarsePatches, count_where_they_deviate_by_no_more_than_is_allowed) {
  constexpr int kUnit = CoarsePatches::kUnit;
  std::mt19937 random(31);
  std::uniform_real_distribution<double> exponent(-8.0, 4.0);
  const HeightTable table = rough_table(90, 70, random, 0.001);
  const CoarsePatches patches(table, HeightInterpolation::bilinear, highest(table));
  std::array<int, kUnit + 1> seen{};
  for (int k = 0; k < 20000; ++k) {
    const int i = k % 12, j = k % 9;
    const double allowed = k == 0 ? 0.0 : k == 1 ? 1e300 : std::exp2(exponent(random));
    const auto allowance = CoarsePatches::allowance(allowed);
    const int level = patches.level_of_unit(allowance, i, j);
    ++seen[size_t(level)];
    if (level > 0) {
      ASSERT_LE(patches.deviation(level, i, j), allowed);
    }
    if (level < kUnit) {
      ASSERT_GT(patches.deviation(level + 1, i, j), 0.99 * allowed);
    }
    const double large = patches.deviation(kUnit + 1, i / 2, j / 2);
    ASSERT_TRUE(large <= allowed || !patches.counts(allowance, kUnit + 1, i / 2, j / 2));
    ASSERT_TRUE(large > 0.99 * allowed || patches.counts(allowance, kUnit + 1, i / 2, j / 2));
  }
  for (const int count : seen) EXPECT_GT(count, 500);
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
      HeightSight sight{0.0, 0.3 * (k % 5), 0.0004};
      const auto hit = field.intersect(ray, {0.0, kInf}, -kInf, sight);
      Beam beam;
      for (int n = 0; n < 4; ++n) {
        beam.o.extendBy(ray.o);
        beam.d.extendBy(normalize(ray.d + 0.004 * Vec3d(n % 2, n / 2, n % 3 - 1)));
        beam.d.extendBy(ray.d);
      }
      sight.clear = field.clear_distance(beam, sight);
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
  double coarseness;  ///< a middling one
};

class Watertight : public testing::TestWithParam<Seen> {};

/// From above all of it to below all of it within the map: every such ray meets the surface. Through nodes,
/// along edges, along grid lines, at any slant, up to 1.5e5 cells from the origin. Seen coarsely, blocks of
/// all sizes lie beside each other.
TEST_P(Watertight, no_ray_slips_through) {
  std::mt19937 random(29);
  const HeightTable table = rough_table(257, 200, random);
  const HeightField field(table, GetParam().interpolation, GetParam().coarseness > 0.0);
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
      const double coarse = GetParam().coarseness * std::exp2(k % 9 - 4);
      const HeightSight sight{0.0, k % 4 == 0 ? 0.0 : coarse, k % 4 == 1 ? 0.0 : coarse / (half + distance)};
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
                                         Seen{"coarse", HeightInterpolation::bilinear, 0.5},
                                         Seen{"coarse_bicubic", HeightInterpolation::bicubic, 0.5}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace pileus
