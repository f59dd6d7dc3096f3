#include "integrators/pixel_cone.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/shaders_cpu/make_plugin.h"

namespace pileus {
namespace {

const Vec2i kPicture(640, 360);

World seen_by(std::shared_ptr<const Camera> camera) {
  World world;
  world.camera = std::move(camera);
  return world;
}

TEST(PixelCone, widens_with_distance_from_a_pinhole) {
  const auto camera = make_plugin<Camera>("perspective", {{"fov_deg", 90.0}});
  const PixelCone cone = middle_pixel_cone(seen_by(camera), kPicture);
  EXPECT_EQ(cone.at_camera, 0.0);
  EXPECT_NEAR(cone.width(10.0), 10.0 * 2.0 / 640, 1e-6) << "the picture is 20 m wide there";
  EXPECT_LT(pixel_cone(*camera, {0.5, 0.5}, kPicture).per_metre, cone.per_metre) << "seen aslant";
}

TEST(PixelCone, is_as_wide_everywhere_for_parallel_rays) {
  const auto camera = make_plugin<Camera>("orthographic", {{"width", 6.4}});
  const PixelCone cone = middle_pixel_cone(seen_by(camera), kPicture);
  EXPECT_NEAR(cone.width(0.0), 0.01, 1e-14);
  EXPECT_NEAR(cone.width(1e3), 0.01, 1e-14);
}

TEST(PixelCone, is_unknown_without_a_picture) {
  EXPECT_EQ(middle_pixel_cone(World{}, Vec2i(0)).width(5.0), 0.0);
}

}  // namespace
}  // namespace pileus
