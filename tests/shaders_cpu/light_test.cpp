#include "lib/scene/light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "lib/scene/background.h"
#include "tests/shaders_cpu/make_plugin.h"

namespace pileus {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(Sun, is_the_same_everywhere) {
  const auto sun = make_plugin<Light>("sun", {{"direction", Vec3d(0, 3, 4)}, {"irradiance", Rgb(3, 2, 1)}});
  EXPECT_TRUE(sun->is_directional());
  for (const Vec3d& p : {Vec3d(0.0), Vec3d(1.5e5, -7, 1e9)}) {
    const Illumination light = sun->at(p);
    EXPECT_EQ(light.irradiance, Rgb(3, 2, 1));
    EXPECT_EQ(light.distance, kInf);
    EXPECT_NEAR(length(light.wi - Vec3d(0, 0.6, 0.8)), 0.0, 1e-16);
  }
}

TEST(Sun, takes_a_direction_of_any_length) {
  for (const double size : {1e-300, 1e300}) {
    const auto sun = make_plugin<Light>("sun", {{"direction", Vec3d(0, size, 0)}});
    EXPECT_EQ(sun->at(Vec3d(0.0)).wi, Vec3d(0, 1, 0));
  }
}

TEST(Sun, refuses_a_direction_that_is_none) {
  for (const double bad : {0.0, -0.0, kInf, std::nan("")}) {
    std::vector<std::string> problems;
    make_plugin<Light>("sun", {{"direction", Vec3d(0, bad, 0)}}, &problems);
    ASSERT_EQ(problems.size(), 1u);
    EXPECT_EQ(problems[0], "direction is zero or not finite; expected a vector towards the light");
  }
}

TEST(PointLight, falls_with_the_square_of_the_distance) {
  const auto light = make_plugin<Light>("point", {{"position", Vec3d(1, 2, 3)}, {"intensity", Rgb(8, 4, 2)}});
  EXPECT_FALSE(light->is_directional());
  const Illumination at = light->at(Vec3d(1, 2, 1));
  EXPECT_EQ(at.wi, Vec3d(0, 0, 1));
  EXPECT_EQ(at.distance, 2.0);
  EXPECT_EQ(at.irradiance, Rgb(2, 1, 0.5));
}

TEST(PointLight, is_finite_everywhere) {
  const Vec3d position(3, 2, 1);
  const auto light =
      make_plugin<Light>("point", {{"position", position}, {"intensity", Rgb(1.0)}, {"radius", 0.1}});
  for (const double away : {0.0, 1e-320, 1e-170, 1e-12, 0.05, 0.1, 1e5, 1e200, 1e308}) {
    const Illumination at = light->at(position + Vec3d(0, 0, -away));
    EXPECT_NEAR(length(at.wi), 1.0, 1e-15) << away;
    EXPECT_TRUE(std::isfinite(at.irradiance.x) && at.irradiance.x >= 0.0) << away;
    EXPECT_LE(at.irradiance.x, 1.0 / (0.1 * 0.1)) << away;
  }
  EXPECT_EQ(light->at(position).irradiance.x, 1.0 / (0.1 * 0.1));
}

TEST(ConstantBackground, is_the_same_everywhere) {
  const auto background = make_plugin<Background>("constant", {{"radiance", Rgb(1, 2, 3)}});
  EXPECT_EQ(background->radiance({0, 1, 0}), Rgb(1, 2, 3));
  EXPECT_EQ(background->radiance({0.6, 0, -0.8}), Rgb(1, 2, 3));
}

TEST(GradientBackground, has_its_three_colours_and_no_step) {
  for (const double exponent : {0.3, 1.0, 2.5}) {
    const auto background = make_plugin<Background>("gradient", {{"zenith", Rgb(0, 0, 1)},
                                                                 {"horizon", Rgb(1, 1, 1)},
                                                                 {"ground", Rgb(1, 0, 0)},
                                                                 {"exponent", exponent}});
    const double past_one = std::nextafter(1.0, 2.0);
    EXPECT_EQ(background->radiance({0, past_one, 0}), Rgb(0, 0, 1));
    EXPECT_EQ(background->radiance({0, -past_one, 0}), Rgb(1, 0, 0));
    EXPECT_EQ(background->radiance({1, 0, 0}), Rgb(1, 1, 1));
    EXPECT_EQ(background->radiance({1, -0.0, 0}), Rgb(1, 1, 1));
    const Rgb above = background->radiance({1, 1e-12, 0}), below = background->radiance({1, -1e-12, 0});
    EXPECT_NEAR(length(above - below), 0.0, 1e-3);
    const double share = std::pow(0.5, exponent);
    EXPECT_NEAR(background->radiance({0.8, 0.5, 0}).x, 1.0 - share, 1e-15);
    EXPECT_NEAR(background->radiance({0.8, -0.5, 0}).y, 1.0 - share, 1e-15);
  }
}

/// By the midpoint rule over the sphere.
Rgb summed_irradiance(const Background& sky, const Vec3d& n) {
  const int rings = 200, spokes = 200;
  Rgb sum(0.0);
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < spokes; ++j) {
      const double y = -1.0 + 2.0 * (i + 0.5) / rings, azimuth = 2.0 * std::numbers::pi * (j + 0.5) / spokes;
      const double across = std::sqrt(1.0 - y * y);
      const Vec3d d(across * std::cos(azimuth), y, across * std::sin(azimuth));
      sum += sky.radiance(d) * (std::max(0.0, dot(n, d)) * 4.0 * std::numbers::pi / (rings * spokes));
    }
  }
  return sum;
}

TEST(Background, irradiance_is_that_of_its_radiance) {
  const auto constant = make_plugin<Background>("constant", {{"radiance", Rgb(1, 2, 3)}});
  for (const double exponent : {0.5, 1.0, 3.0}) {
    const auto gradient = make_plugin<Background>("gradient", {{"exponent", exponent}});
    for (const Vec3d& v :
         {Vec3d(0, 1, 0), Vec3d(0, -1, 0), Vec3d(1, 0, 0), Vec3d(0.3, 0.5, -1), Vec3d(1, -2, 3)}) {
      const Vec3d n = normalize(v);
      for (const auto& sky : {constant, gradient}) {
        const Rgb expected = summed_irradiance(*sky, n), found = sky->irradiance(n);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c] / expected[c], 1.0, 5e-4) << exponent << " " << v;
      }
    }
  }
}

}  // namespace
}  // namespace pileus
