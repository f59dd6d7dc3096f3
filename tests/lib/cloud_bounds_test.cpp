// Hunts for points where a cloud's density leaves its bounds. PILEUS_HUNT multiplies the number of points.
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "lib/cloud/cloud_presets.h"
#include "lib/cloud/cloud_region.h"
#include "lib/cloud/procedural_cloud.h"
#include "lib/freeform/shapes.h"
#include "tests/fixtures/hunt.h"
#include "tests/fixtures/random_clouds.h"

namespace pileus {
namespace {

/// The range by the scalar function and by the batch at the points of a box.
void expect_within(const CloudRegion& region, const ProceduralCloud& cloud, const Box3d& box,
                   RandomClouds& random, int points, int& decided) {
  const Interval range = region.range();
  ASSERT_TRUE(0 <= range.lo && range.lo <= range.hi && range.hi <= 1 + 1e-5) << range.lo << " " << range.hi;
  decided += range.hi == 0 || range.lo == 1;
  for (int i = 0; i < points; ++i) {
    const Vec3d p = random.point_in(box);
    const double rho = cloud.density(p);
    ASSERT_TRUE(range.contains(rho)) << p << ": " << rho << " is not within " << range.lo << " .. "
                                     << range.hi;
  }
  const PointLattice block{box.min, box.size() / 3.0, Vec3i(4)};
  std::array<float, 64> rho;
  region.densities(block, rho);
  for (const float value : rho) {
    ASSERT_TRUE(range.contains(double(value)))
        << value << " is not within " << range.lo << " .. " << range.hi;
  }
}

TEST(CloudBounds, hold_for_random_recipes_and_boxes) {
  RandomClouds random(21);
  int decided = 0;
  const int clouds = hunted(400), boxes = 8, points = 6;
  for (int n = 0; n < clouds; ++n) {
    const ProceduralCloud cloud(random.recipe(), random.cloud_form());
    for (int b = 0; b < boxes; ++b) {
      const Box3d box = random.box_near(cloud.bounds());
      expect_within(CloudRegion(cloud, box), cloud, box, random, points, decided);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(decided, clouds);
  EXPECT_LT(decided, clouds * boxes);
}

TEST(CloudBounds, hold_for_noise) {
  RandomClouds random(24);
  double narrow = 0;
  const int noises = hunted(400), boxes = 5, points = 10;
  std::array<float, 64> sums;
  for (int n = 0; n < noises; ++n) {
    const double frequency = std::pow(10.0, random.uniform(-2, 2));
    const CloudNoise noise(random.noise(), frequency);
    for (int b = 0; b < boxes; ++b) {
      const double edge = std::pow(10.0, random.uniform(-4, 1)) / frequency;
      const Vec3d at = random.point(random.chance(0.1) ? 1e5 : 10);
      const Box3d box(at, at + Vec3d(edge, edge * random.uniform(0, 1), edge * random.uniform(0, 1)));
      const Interval range = noise.range(box);
      narrow += range.width() < 0.5;
      for (int i = 0; i < points; ++i) {
        const Vec3d p = random.point_in(box);
        ASSERT_TRUE(range.contains(noise.value(p))) << p << ": " << noise.value(p);
      }
      noise.octave_sums(0, noise.octaves(), {box.min, box.size() / 3.0, Vec3i(4)}, sums);
      for (const float sum : sums) ASSERT_TRUE(range.contains(double(noise.level(sum)))) << noise.level(sum);
    }
  }
  EXPECT_GT(narrow, 0.2 * noises * boxes);
}

TEST(CloudBounds, hold_for_widened_and_sheared_shapes) {
  RandomClouds random(25);
  for (int n = 0; n < hunted(200); ++n) {
    const CloudRecipe recipe = random.recipe();
    const CloudShape shape(recipe, random.cloud_form());
    for (int b = 0; b < 10; ++b) {
      const Box3d box = random.box_near(shape.bounds()), form_box = shape.form_box(box);
      for (int i = 0; i < 10; ++i) {
        const Vec3d p = random.point_in(box), q = shape.form_point(p);
        ASSERT_TRUE(form_box.intersects(q)) << p << " becomes " << q;
        const bool may_be_inside = shape.form().bounds().intersects(q);
        ASSERT_TRUE(!may_be_inside || shape.bounds().intersects(p)) << p << " becomes " << q;
      }
    }
  }
}

TEST(CloudBounds, hold_for_parts_of_parts) {
  RandomClouds random(22);
  int decided = 0;
  for (int n = 0; n < hunted(100); ++n) {
    const ProceduralCloud cloud(random.recipe(), random.cloud_form());
    Box3d box = cloud.bounds();
    CloudRegion region(cloud, box);
    for (int level = 0; level < 8; ++level) {
      const Vec3d middle = box.center();
      for (int axis = 0; axis < 3; ++axis) (random.chance(0.5) ? box.min : box.max)[axis] = middle[axis];
      region = region.within(box);
      expect_within(region, cloud, box, random, 4, decided);
      if (HasFatalFailure()) return;
    }
  }
}

TEST(CloudBounds, batches_agree_with_the_function) {
  RandomClouds random(23);
  double worst = 0;
  int inside = 0;
  for (int n = 0; n < hunted(60); ++n) {
    const CloudRecipe recipe = random.tame_recipe();
    const ProceduralCloud cloud(recipe, random.cloud_form());
    const Box3d box = random.box_near(cloud.bounds());
    const PointLattice block{box.min, box.size() / 7.0, Vec3i(8)};
    std::array<float, 512> rho;
    CloudRegion(cloud, box).densities(block, rho);
    for (int i = 0; i < 8; ++i) {
      for (int j = 0; j < 8; ++j) {
        for (int k = 0; k < 8; ++k) {
          const double expected = cloud.density(block.first + block.step * Vec3d(i, j, k));
          const double difference = std::fabs(double(rho[size_t((i * 8 + j) * 8 + k)]) - expected);
          inside += 0 < expected && expected < 1;
          worst = std::max(worst, difference / recipe.sharpness);
        }
      }
    }
  }
  EXPECT_GT(inside, 1000);
  EXPECT_LT(worst, 2e-4);
}

TEST(CloudBounds, far_boxes_and_boxes_without_size_are_no_trouble) {
  const ProceduralCloud cloud(CloudRecipe{}, ellipsoid({0, 1.6, 0}, {3, 1.6, 2.2}));
  EXPECT_TRUE(cloud.is_empty({Vec3d(1e12), Vec3d(2e12)}));
  EXPECT_TRUE(cloud.is_empty({Vec3d(-1e300), Vec3d(-1e299)}));
  const Box3d everywhere{Vec3d(-1e300), Vec3d(1e300)};
  EXPECT_TRUE(cloud.range(everywhere).contains(0) && cloud.range(everywhere).contains(1));
  for (const Vec3d& p : {Vec3d(0, 1.6, 0), Vec3d(1.2, 2.1, 0.3)}) {
    EXPECT_TRUE(cloud.range({p, p}).contains(cloud.density(p)));
    EXPECT_LT(cloud.range({p, p}).width(), 0.01);
  }
}

}  // namespace
}  // namespace pileus
