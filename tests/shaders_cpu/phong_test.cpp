#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "lib/scene/surface_shader.h"
#include "tests/shaders_cpu/make_plugin.h"

namespace pileus {
namespace {

const Vec3d kUp(0, 1, 0);
const Vec3d kSlant(0.6, 0.8, 0);

std::shared_ptr<SurfaceShader> phong(double diffuse, double specular, double shininess = 32.0) {
  return make_plugin<SurfaceShader>(
      "phong", {{"diffuse", Rgb(diffuse)}, {"specular", Rgb(specular)}, {"shininess", shininess}});
}
Illumination from(const Vec3d& wi, const Rgb& irradiance) {
  return {wi, 1.0, irradiance};
}
Rgb shade(const SurfaceShader& shader, const Vec3d& n, const Vec3d& wo, const Illumination& light) {
  return shader.shade({Vec3d(0.0), n}, wo, {&light, 1});
}

TEST(Phong, white_surface_facing_the_light_shows_e_over_pi) {
  const Rgb radiance = shade(*phong(1, 0), kUp, kSlant, from(kUp, Rgb(3, 2, 1)));
  EXPECT_NEAR(radiance.x, 3.0 / std::numbers::pi, 1e-15);
  EXPECT_NEAR(radiance.z, 1.0 / std::numbers::pi, 1e-15);
}

TEST(Phong, diffuse_light_falls_with_the_cosine) {
  EXPECT_NEAR(shade(*phong(0.5, 0), kUp, kUp, from(kSlant, Rgb(1.0))).x, 0.4 / std::numbers::pi, 1e-15);
}

TEST(Phong, highlight_is_brightest_in_the_mirror_direction) {
  const auto shader = phong(0, 1, 100);
  const Illumination light = from(kSlant, Rgb(1.0));
  const Vec3d mirrored(-0.6, 0.8, 0);
  EXPECT_NEAR(shade(*shader, kUp, mirrored, light).x, 1.0 / std::numbers::pi, 1e-13);
  const Vec3d beside = normalize(mirrored + Vec3d(0, 0, 0.1));
  EXPECT_NEAR(shade(*shader, kUp, beside, light).x, std::pow(dot(mirrored, beside), 100) / std::numbers::pi,
              1e-13);
}

TEST(Phong, sharpest_highlight_keeps_its_digits) {
  // One part in 1e10 off the mirror direction: the cosine itself rounds to 1.
  const double angle = 1e-10, n = 1e20;
  const Vec3d wo(std::sin(angle), std::cos(angle), 0);
  EXPECT_NEAR(shade(*phong(0, 1, n), kUp, wo, from(kUp, Rgb(1.0))).x,
              std::exp(-0.5 * n * angle * angle) / std::numbers::pi, 1e-9);
}

TEST(Phong, lights_below_the_horizon_give_nothing) {
  const auto shader = phong(1, 1);
  for (const Vec3d& wi : {Vec3d(0, -1, 0), Vec3d(1, 0, 0), Vec3d(0.6, -0.8, 0)}) {
    EXPECT_EQ(shade(*shader, kUp, kSlant, from(wi, Rgb(5.0))), Rgb(0.0));
  }
}

TEST(Phong, lights_add_up_and_none_is_dark) {
  const auto shader = phong(0.7, 0.3);
  const std::array<Illumination, 2> lights{from(kUp, Rgb(1, 0, 0)), from(kSlant, Rgb(0, 2, 0))};
  const Rgb sum = shade(*shader, kUp, kUp, lights[0]) + shade(*shader, kUp, kUp, lights[1]);
  EXPECT_EQ(shader->shade({Vec3d(0.0), kUp}, kUp, lights), sum);
  EXPECT_EQ(shader->shade({Vec3d(0.0), kUp}, kUp, {}), Rgb(0.0));
}

TEST(Phong, ambient_light_needs_no_lamp) {
  const auto shader = make_plugin<SurfaceShader>(
      "phong", {{"ambient", Rgb(0.5, 0.25, 1)}, {"ambient_radiance", Rgb(2, 2, 0.5)}});
  EXPECT_EQ(shader->shade({Vec3d(0.0), kUp}, kUp, {}), Rgb(1, 0.5, 0.5));
}

}  // namespace
}  // namespace pileus
