#include "lib/cloud/procedural_cloud.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lib/core/param_table.h"
#include "lib/freeform/shapes.h"
#include "lib/math/affine.h"
#include "lib/noise/fbm.h"

namespace pileus {
namespace {

FreeForm blob() {
  return ellipsoid({0, 1.6, 0}, {3, 1.6, 2.2});
}

std::vector<std::string> problems_of(std::vector<Vec2d> height_profile) {
  CloudRecipe recipe;
  recipe.height_profile = std::move(height_profile);
  std::vector<std::string> problems;
  recipe.check(problems);
  return problems;
}

TEST(CloudRecipe, defaults_are_within_their_ranges_and_pass_the_check) {
  CloudRecipe recipe;
  ParamTable table;
  recipe.describe(table);  // fails on a name taken twice
  std::vector<std::string> problems;
  recipe.check(problems);
  EXPECT_TRUE(problems.empty());
}

TEST(CloudRecipe, refuses_bad_height_profiles) {
  EXPECT_EQ(
      problems_of({}),
      (std::vector<std::string>{"height_profile is empty; expected at least one [relative height, value]"}));
  EXPECT_EQ(problems_of({{0, 0}, {0.5, 1}, {0.25, 1}}),
            (std::vector<std::string>{
                "height_profile has the height 0.25 after 0.5; expected heights that increase"}));
  EXPECT_EQ(problems_of({{0.5, 0}, {0.5, 1}}).size(), 1u) << "a jump would break the continuity";
  EXPECT_EQ(problems_of({{-0.1, 0}}),
            (std::vector<std::string>{
                "height_profile point 1 is [-0.1, 0]; expected a height from 0 to 1 and a value from "
                "0 to 1"}));
  EXPECT_EQ(problems_of({{0, std::nan("")}}).size(), 1u);
  EXPECT_FALSE(problems_of({{std::nan(""), 0}, {1, 0}}).empty());
  EXPECT_TRUE(problems_of({{0.5, 1}}).empty()) << "one point is a constant";
}

TEST(ProceduralCloud, closed_form_without_noise) {
  CloudRecipe recipe;
  recipe.erosion = 0, recipe.threshold = 0.2, recipe.sharpness = 1, recipe.edge = 0.5;
  recipe.height_profile = {{0, 0}, {1, 1}};
  const ProceduralCloud cloud(recipe, blob());
  for (const double x : {0.0, 0.5, 1.0, 2.0, 2.5, 2.9, 3.5}) {
    const double depth = std::clamp((1 - x / 3) / 0.5, 0.0, 1.0);  // at half height, where the profile is 1/2
    const double coverage = 0.5 * depth * depth * (3 - 2 * depth);
    EXPECT_NEAR(cloud.density({x, 1.6, 0}), std::max(0.0, coverage - 0.2) / 0.8, 1e-12) << x;
  }
}

TEST(ProceduralCloud, agrees_with_its_definition) {
  CloudRecipe recipe;
  recipe.noise.frequency = 0.7;
  recipe.height_profile = {{0, 1}, {1, 1}};
  const ProceduralCloud cloud(recipe, blob());
  const Fbm billows({recipe.noise.octaves, recipe.noise.frequency, recipe.noise.lacunarity, recipe.noise.gain,
                     recipe.noise.seed});
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  int between = 0;
  for (int n = 0; n < 5000; ++n) {
    const Vec3d local(coordinate(random), coordinate(random), coordinate(random));
    const double radius = local.length();
    if (radius >= 1) continue;
    const Vec3d p = Vec3d(0, 1.6, 0) + local * Vec3d(3, 1.6, 2.2);
    const double depth = std::min(1.0, (1 - radius) / recipe.edge);
    const double carved = depth * depth * (3 - 2 * depth) -
                          recipe.erosion * std::pow(1 - billows.value(OctaveSum::billow, p), 2);
    const double expected =
        std::clamp(recipe.sharpness * (carved - recipe.threshold) / (1 - recipe.threshold), 0.0, 1.0);
    ASSERT_NEAR(cloud.density(p), expected, 1e-10) << p;
    between += 0 < expected && expected < 1;
  }
  EXPECT_GT(between, 100);
}

TEST(ProceduralCloud, boils_in_place_and_is_the_same_again_after_a_turn) {
  const auto cloud_at = [](double evolution) {
    CloudRecipe recipe;
    recipe.noise.evolution = evolution;
    return ProceduralCloud(recipe, blob());
  };
  const ProceduralCloud still = cloud_at(0), later = cloud_at(0.25), whole_turn = cloud_at(1);
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5);
  int changed = 0;
  for (int n = 0; n < 500; ++n) {
    const Vec3d p = Vec3d(0, 1.6, 0) + Vec3d(coordinate(random), coordinate(random), coordinate(random));
    EXPECT_NEAR(whole_turn.density(p), still.density(p), 1e-12);
    changed += std::fabs(later.density(p) - still.density(p)) > 0.05;
  }
  EXPECT_GT(changed, 50);
}

TEST(ProceduralCloud, is_zero_outside_the_free_form_and_below_the_base) {
  const ProceduralCloud cloud(CloudRecipe{}, blob());
  std::mt19937_64 random(10);
  std::uniform_real_distribution<double> coordinate(-5, 5);
  for (int n = 0; n < 20000; ++n) {
    const Vec3d p(coordinate(random), coordinate(random), coordinate(random));
    const double rho = cloud.density(p);
    ASSERT_TRUE(0 <= rho && rho <= 1);
    if (blob().value(p) <= 0 || p.y < 0.32 * 3.2) {
      ASSERT_EQ(rho, 0.0) << p;
    }
  }
}

TEST(ProceduralCloud, is_zero_where_a_coordinate_is_not_finite) {
  const ProceduralCloud cloud(CloudRecipe{}, blob());
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(cloud.density({infinity, 1, 0}), 0.0);
  EXPECT_EQ(cloud.density({0, -infinity, 0}), 0.0);
  EXPECT_EQ(cloud.density({0, 1, std::nan("")}), 0.0);
}

TEST(ProceduralCloud, is_continuous) {
  const ProceduralCloud cloud(CloudRecipe{}, blob());
  for (int i = 0; i < 200000; ++i) {  // a path from outside through the cloud, in steps of 32 µm
    const double x = -3.2 + i * 32e-6;
    ASSERT_NEAR(cloud.density({x, 1.9, 0.1}), cloud.density({x + 32e-6, 1.9, 0.1}), 0.01) << x;
  }
}

TEST(ProceduralCloud, empty_boxes_hold_nothing) {
  const ProceduralCloud cloud(CloudRecipe{}, blob());
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> coordinate(-3.5, 3.5), share(0, 1);
  int empty = 0;
  for (int n = 0; n < 2000; ++n) {
    const Vec3d low(coordinate(random), coordinate(random), coordinate(random));
    const Box3d box(low, low + Vec3d(0.4));
    if (!cloud.is_empty(box)) continue;
    ++empty;
    for (int i = 0; i < 50; ++i) {
      ASSERT_EQ(cloud.density(low + 0.4 * Vec3d(share(random), share(random), share(random))), 0.0);
    }
  }
  EXPECT_GT(empty, 200);
  EXPECT_LT(empty, 1990);
}

TEST(ProceduralCloud, scales_with_its_free_form) {
  const FreeForm large = placed(blob(), Affine::scaling(Vec3d(1024)));  // the automatic frequency follows
  const ProceduralCloud small_cloud(CloudRecipe{}, blob()), large_cloud(CloudRecipe{}, large);
  for (const double x : {-2.0, -1.0, 0.0, 0.7}) {
    EXPECT_EQ(small_cloud.density({x, 1.9, 0.2}), large_cloud.density(1024.0 * Vec3d(x, 1.9, 0.2)));
  }
}

}  // namespace
}  // namespace pileus
