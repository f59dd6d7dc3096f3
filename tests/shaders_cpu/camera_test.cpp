#include "lib/scene/camera.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <random>

#include <gtest/gtest.h>

#include "tests/shaders_cpu/make_plugin.h"

namespace pileus {
namespace {

const Vec2i kSize(640, 360);
const Vec2d kMiddle(320, 180);
const std::vector<Vec2d> kPixels{{0, 0},     {640, 0},   {0, 360},       {640, 360},
                                 {320, 180}, {0.5, 0.5}, {123.25, 301.5}};

/// The same view, with everything moved by `offset`.
std::vector<ParamSetting> view(const Vec3d& offset) {
  return {{"position", offset + Vec3d(1, 2, 3)},
          {"look_at", offset + Vec3d(-2, 1, -1)},
          {"up", Vec3d(0.1, 1, 0)}};
}

class Cameras : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Camera, Cameras, testing::Values("perspective", "orthographic"),
                         [](const auto& test) { return std::string(test.param); });

TEST_P(Cameras, rays_have_unit_length) {
  const auto camera = make_plugin<Camera>(GetParam(), view(Vec3d(0.0)));
  for (const Vec2d& pixel : kPixels) EXPECT_NEAR(length(camera->ray(pixel, kSize).d), 1.0, 4e-16);
}

TEST_P(Cameras, the_middle_looks_at_look_at) {
  const auto camera = make_plugin<Camera>(GetParam(), view(Vec3d(0.0)));
  const Ray ray = camera->ray(kMiddle, kSize);
  EXPECT_EQ(ray.o, Vec3d(1, 2, 3));
  EXPECT_NEAR(length(ray.d - normalize(Vec3d(-3, -1, -4))), 0.0, 4e-16);
}

TEST_P(Cameras, matrices_agree_with_rays) {
  const auto camera = make_plugin<Camera>(GetParam(), view(Vec3d(0.0)));
  for (const Vec2d& pixel : kPixels) {
    const Vec3d p = camera->ray(pixel, kSize).at(7.5);
    Vec3d in_camera, on_screen;
    camera->camera_from_world().multVecMatrix(p, in_camera);
    EXPECT_LT(in_camera.z, 0.0);
    camera->screen_from_world(kSize).multVecMatrix(p, on_screen);
    EXPECT_NEAR(on_screen.x, 2.0 * pixel.x / kSize.x - 1.0, 1e-14);
    EXPECT_NEAR(on_screen.y, 1.0 - 2.0 * pixel.y / kSize.y, 1e-14);
  }
}

TEST_P(Cameras, camera_space_is_a_rotation) {
  const auto camera = make_plugin<Camera>(GetParam(), view(Vec3d(0.0)));
  EXPECT_NEAR(camera->camera_from_world().determinant(), 1.0, 1e-15);
}

TEST_P(Cameras, see_as_sharply_far_from_the_origin) {
  // Offsets that leave the positions themselves exact.
  const Vec3d offset(150000, -131072, 98304);
  const auto here = make_plugin<Camera>(GetParam(), view(Vec3d(0.0)));
  const auto there = make_plugin<Camera>(GetParam(), view(offset));
  for (const Vec2d& pixel : kPixels) {
    const Ray a = here->ray(pixel, kSize), b = there->ray(pixel, kSize);
    EXPECT_EQ(a.d, b.d);
    EXPECT_NEAR(length((b.o - offset) - a.o), 0.0, 4e-11) << "one rounding of the position";
  }
}

TEST_P(Cameras, beams_hold_all_rays_of_their_rectangles_and_little_more) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const auto pixel = [&] { return Vec2d(uniform(random) * kSize.x, uniform(random) * kSize.y); };
  for (int n = 0; n < 2000; ++n) {
    const Vec3d offset = std::pow(10.0, 8.0 * uniform(random)) * Vec3d(1, -2, 3);
    const auto camera = make_plugin<Camera>(GetParam(), view(n % 2 ? offset : Vec3d(0.0)));
    const Vec2d lo = pixel(), hi = n % 3 ? lo + Vec2d(16.0) : lo + pixel();
    const std::optional<Beam> beam = camera->beam(lo, hi, kSize);
    ASSERT_TRUE(beam);
    Box3d o, d;
    for (int k = 0; k < 20; ++k) {
      const Vec2d share(k < 4 ? k & 1 : uniform(random), k < 4 ? k >> 1 : uniform(random));
      const Ray ray = camera->ray(lo + share * (hi - lo), kSize);
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_TRUE(beam->o.min[axis] <= ray.o[axis] && ray.o[axis] <= beam->o.max[axis]);
        ASSERT_TRUE(beam->d.min[axis] <= ray.d[axis] && ray.d[axis] <= beam->d.max[axis]);
      }
      o.extendBy(ray.o), d.extendBy(ray.d);
    }
    if (n % 3 == 0) continue;  // wide ones may hold more
    EXPECT_LT(length(beam->d.size()), 2.0 * length(d.size()) + 1e-12);
    EXPECT_LT(length(beam->o.size()), 2.0 * length(o.size()) + 1e-12 * (1.0 + length(o.min)));
  }
}

TEST_P(Cameras, refuse_a_frame_that_is_none) {
  const double inf = std::numeric_limits<double>::infinity(), nan = std::nan("");
  const auto problem = [](const std::vector<ParamSetting>& settings) {
    std::vector<std::string> problems;
    make_plugin<Camera>(GetParam(), settings, &problems);
    return problems.size() == 1 ? problems[0] : "not one problem";
  };
  const Vec3d p(1, 2, 3);
  const std::string same = "look_at equals position, or one is not finite; expected two different points";
  const std::string parallel = "up is parallel to the view direction; expected any other direction";
  const std::string no_up = "up is zero or not finite; expected a direction";
  EXPECT_EQ(problem({{"position", p}, {"look_at", p}}), same);
  EXPECT_EQ(problem({{"position", p}, {"look_at", Vec3d(inf, 0, 0)}}), same);
  EXPECT_EQ(problem({{"position", Vec3d(0, nan, 0)}}), same);
  EXPECT_EQ(problem({{"position", p}, {"look_at", p + Vec3d(0, -4, 0)}}), parallel);
  EXPECT_EQ(problem({{"position", p}, {"look_at", p + Vec3d(2, 2, 2)}, {"up", Vec3d(-1, -1, -1)}}), parallel);
  EXPECT_EQ(problem({{"up", Vec3d(0.0)}}), no_up);
  EXPECT_EQ(problem({{"up", Vec3d(nan, 1, 0)}}), no_up);
}

TEST_P(Cameras, take_extreme_but_sound_frames) {
  for (const double size : {1e-200, 1e-12, 1e12, 1e200}) {
    const auto camera = make_plugin<Camera>(
        GetParam(), {{"position", Vec3d(0.0)}, {"look_at", Vec3d(0, 0, -size)}, {"up", Vec3d(0, size, 0)}});
    EXPECT_EQ(camera->ray(kMiddle, kSize).d, Vec3d(0, 0, -1)) << size;
  }
}

TEST(Perspective, field_of_view_is_horizontal) {
  const auto camera = make_plugin<Camera>(
      "perspective", {{"position", Vec3d(0.0)}, {"look_at", Vec3d(0, 0, -1)}, {"fov_deg", 60.0}});
  const Vec3d left = camera->ray({0, 180}, kSize).d, right = camera->ray({640, 180}, kSize).d;
  EXPECT_NEAR(std::acos(dot(left, right)), std::numbers::pi / 3.0, 1e-14);
  EXPECT_LT(left.x, 0.0) << "x runs to the right";
  EXPECT_GT(camera->ray({320, 0}, kSize).d.y, 0.0) << "rows run downwards";
}

TEST(Orthographic, image_is_as_wide_as_asked) {
  const auto camera = make_plugin<Camera>("orthographic", {{"width", 6.0}});
  const Ray left = camera->ray({0, 180}, kSize), right = camera->ray({640, 180}, kSize);
  EXPECT_EQ(left.d, right.d);
  EXPECT_NEAR(right.o.x - left.o.x, 6.0, 1e-15);
  EXPECT_NEAR(camera->ray({320, 0}, kSize).o.y - camera->ray({320, 360}, kSize).o.y, 6.0 * 360 / 640, 1e-15);
}

}  // namespace
}  // namespace pileus
