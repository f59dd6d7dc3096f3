#include "lib/texture/projection.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace pileus {
namespace {

constexpr Projection kAll[] = {Projection::planar, Projection::spherical, Projection::cylindrical};

Vec2d uv(Projection projection, const Vec3d& p) {
  return project(projection, p).uv;
}

TEST(Projection, lies_as_its_description_says) {
  EXPECT_EQ(uv(Projection::planar, {-0.5, 7, -0.5}), Vec2d(0, 0)) << "north-west, from above";
  EXPECT_EQ(uv(Projection::planar, {0.5, 7, 0.25}), Vec2d(1, 0.75));
  EXPECT_EQ(uv(Projection::spherical, {0, 0, 3}), Vec2d(0.5, 0.5));
  EXPECT_EQ(uv(Projection::spherical, {2, 0, 0}), Vec2d(0.75, 0.5)) << "right, as seen from outside";
  EXPECT_NEAR(uv(Projection::spherical, {0, 1, 1}).y, 0.25, 1e-16) << "up is the top";
  EXPECT_EQ(uv(Projection::cylindrical, {-2, 0.5, 0}), Vec2d(0.25, 0));
  EXPECT_EQ(uv(Projection::cylindrical, {0, -0.25, 9}), Vec2d(0.5, 0.75));
}

TEST(Projection, has_the_gradients_of_its_places) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> coordinate(-2.0, 2.0);
  for (const Projection projection : kAll) {
    for (int n = 0; n < 2000; ++n) {
      const Vec3d p(coordinate(random), coordinate(random), coordinate(random));
      if (std::hypot(p.x, p.z) < 0.05 || (std::fabs(p.x) < 0.01 && p.z < 0)) continue;
      const PicturePlace place = project(projection, p);
      for (int axis = 0; axis < 3; ++axis) {
        Vec3d step(0.0);
        step[axis] = 1e-6;
        const Vec2d slope = (uv(projection, p + step) - uv(projection, p - step)) * (0.5 / 1e-6);
        EXPECT_NEAR(place.du[axis], slope.x, 1e-7 * (1 + place.du.length()));
        EXPECT_NEAR(place.dv[axis], slope.y, 1e-7 * (1 + place.dv.length()));
      }
    }
  }
}

/// Across the seam u jumps by exactly one picture, but its gradient, and so what is filtered, does not.
TEST(Projection, meets_itself_at_the_seam) {
  for (const Projection projection : {Projection::spherical, Projection::cylindrical}) {
    for (const double aside : {1e-3, 1e-9, 1e-15, 1e-30, 1e-300}) {
      const PicturePlace left = project(projection, {-aside, 0.3, -2.0});
      const PicturePlace right = project(projection, {aside, 0.3, -2.0});
      EXPECT_NEAR(left.uv.x, 0.0, aside / 10 + 1e-16);
      EXPECT_NEAR(right.uv.x, 1.0, aside / 10 + 1e-16);
      EXPECT_EQ(left.uv.y, right.uv.y);
      EXPECT_NEAR(left.du.x, right.du.x, 1e-15);
      EXPECT_NEAR(left.du.z, right.du.z, aside);
    }
    EXPECT_TRUE(uv(projection, {0.0, 0.3, -2.0}).x == 1.0);
    EXPECT_TRUE(uv(projection, {-0.0, 0.3, -2.0}).x == 0.0);
  }
}

TEST(Projection, is_finite_at_poles_and_in_the_middle) {
  for (const Projection projection : kAll) {
    for (const double y : {0.0, 1.0, -1.0, 1e-310, 1e150, -1e-200}) {
      for (const double x : {0.0, -0.0, 1e-310, 1e-160, -1e-20, 1e150}) {
        const PicturePlace place = project(projection, {x, y, 0.0});
        EXPECT_TRUE(std::isfinite(place.uv.x) && std::isfinite(place.uv.y));
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_TRUE(std::isfinite(place.du[axis]) && std::isfinite(place.dv[axis])) << x << " " << y;
        }
      }
    }
  }
  EXPECT_EQ(uv(Projection::spherical, {0, 1, 0}), Vec2d(0.5, 0));
  EXPECT_EQ(uv(Projection::spherical, {0, -1, 0}), Vec2d(0.5, 1));
  // Near a pole the latitude keeps its digits; acos(y / r) would have lost them.
  EXPECT_NEAR(uv(Projection::spherical, {1e-12, 1, 0}).y * M_PI, 1e-12, 1e-26);
}

/// Against long double: a few roundings wherever the point lies.
TEST(Projection, keeps_its_digits) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> coordinate;
  std::uniform_real_distribution<double> exponent(-12.0, 12.0);
  const long double pi = std::acos(-1.0L);
  for (int n = 0; n < 20000; ++n) {
    const Vec3d p(coordinate(random) * std::exp2(exponent(random)),
                  coordinate(random) * std::exp2(exponent(random)),
                  coordinate(random) * std::exp2(exponent(random)));
    const Vec2d got = uv(Projection::spherical, p);
    const long double x = p.x, y = p.y, z = p.z;
    EXPECT_NEAR(got.x, double(0.5L + std::atan2(x, z) / (2 * pi)), 9e-16);
    EXPECT_NEAR(got.y, double(std::atan2(std::hypot(x, z), y) / pi), 9e-16);
  }
}

}  // namespace
}  // namespace pileus
