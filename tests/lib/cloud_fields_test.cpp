#include "lib/cloud/cloud_fields.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "lib/cloud/procedural_cloud.h"
#include "lib/freeform/shapes.h"

namespace pileus {
namespace {

ProceduralCloud blob() {
  return {CloudRecipe{}, ellipsoid({0, 1.6, 0}, {3, 1.6, 2.2})};
}

TEST(CloudFields, temperature_falls_with_height_and_rises_with_density) {
  const ProceduralCloud cloud = blob();
  CloudFieldsRecipe recipe;
  recipe.temperature = 300, recipe.lapse = 2, recipe.excess = 50;
  const CloudFields fields(recipe, cloud);
  EXPECT_NEAR(fields.temperature({1, 0, 1}, 0), 300, 1e-12);
  EXPECT_NEAR(fields.temperature({1, 3, 1}, 0), 294, 1e-12);
  EXPECT_NEAR(fields.temperature({1, 3, 1}, 0.5), 319, 1e-12);
}

TEST(CloudFields, colour_goes_from_bottom_to_top) {
  const ProceduralCloud cloud = blob();
  CloudFieldsRecipe recipe;
  recipe.color_bottom = {0.2, 0.4, 0.6}, recipe.color_top = {1, 1, 1};
  const CloudFields fields(recipe, cloud);
  EXPECT_NEAR(fields.color({0, 0, 0}).x, 0.2, 1e-12);
  EXPECT_NEAR(fields.color({0, 1.6, 0}).y, 0.7, 1e-12);
  EXPECT_EQ(fields.color({0, 9, 0}), Rgb(1, 1, 1));
}

TEST(CloudFields, velocity_is_wind_updraft_and_eddies_that_do_not_diverge) {
  const ProceduralCloud cloud = blob();
  CloudFieldsRecipe recipe;
  recipe.wind = {3, 0, 1}, recipe.updraft = 2;
  EXPECT_EQ(CloudFields(recipe, cloud).velocity({1, 1, 1}, 0.5), Vec3d(3, 1, 1));

  recipe = {};
  recipe.turbulence = 4;
  const CloudFields fields(recipe, cloud);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> coordinate(-3, 3);
  double squares = 0;
  constexpr int kPoints = 2000;
  constexpr double kStep = 1e-5;
  for (int n = 0; n < kPoints; ++n) {
    const Vec3d p(coordinate(random), coordinate(random), coordinate(random));
    double divergence = 0;
    for (int axis = 0; axis < 3; ++axis) {
      Vec3d step(0.0);
      step[axis] = kStep;
      divergence += (fields.velocity(p + step, 0)[axis] - fields.velocity(p - step, 0)[axis]) / (2 * kStep);
    }
    ASSERT_NEAR(divergence, 0, 1e-4) << p;
    squares += fields.velocity(p, 0).length2();
  }
  EXPECT_NEAR(std::sqrt(squares / kPoints), 4, 1) << "turbulence is a typical speed";
}

}  // namespace
}  // namespace pileus
