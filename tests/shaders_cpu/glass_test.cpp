#include <cmath>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "lib/scene/surface_shader.h"
#include "tests/shaders_cpu/make_plugin.h"

namespace pileus {
namespace {

const Vec3d kUp(0, 1, 0);

std::vector<ScatteredRay> scattered(const SurfaceShader& shader, const Vec3d& wo, bool is_inside) {
  std::vector<ScatteredRay> rays;
  SurfacePoint point{Vec3d(0.0), kUp};
  point.is_inside = is_inside;
  shader.append_scattered(point, wo, rays);
  return rays;
}

TEST(Glass, shares_the_view_between_two_directions) {
  const auto glass = make_plugin<SurfaceShader>("glass");
  for (const double x : {0.0, 0.3, 0.9, 0.9999}) {
    const Vec3d wo(x, std::sqrt(1.0 - x * x), 0.0);
    const auto rays = scattered(*glass, wo, false);
    ASSERT_EQ(rays.size(), 2u);
    EXPECT_NEAR(rays[0].weight.x + rays[1].weight.x, 1.0, 1e-15);
    EXPECT_TRUE(rays[0].passes && rays[0].d.y < 0.0);
    EXPECT_TRUE(!rays[1].passes && rays[1].d.y > 0.0);
    EXPECT_NEAR(rays[0].d.x, -x / 1.5, 1e-15);
  }
}

TEST(Glass, reflects_all_beyond_the_critical_angle) {
  const auto glass = make_plugin<SurfaceShader>("glass");
  const double critical = 1.0 / 1.5;
  for (const auto& [sine, count] : {std::pair(critical - 1e-9, 2u), std::pair(critical + 1e-9, 1u)}) {
    const auto rays = scattered(*glass, {sine, std::sqrt(1.0 - sine * sine), 0.0}, true);
    EXPECT_EQ(rays.size(), count);
    EXPECT_FALSE(rays.back().passes);
    EXPECT_EQ(rays.back().weight == Rgb(1.0), count == 1);
  }
  EXPECT_EQ(scattered(*glass, {critical + 1e-9, 0.7, 0.0}, false).size(), 2u) << "from outside never";
}

TEST(Glass, a_thin_one_is_not_seen) {
  const auto nothing = make_plugin<SurfaceShader>("glass", {{"ior", 1.0}});
  const Vec3d wo(0.6, 0.8, 0.0);
  const auto rays = scattered(*nothing, wo, false);
  EXPECT_EQ(rays[0].weight, Rgb(1.0));
  EXPECT_NEAR(length(rays[0].d + wo), 0.0, 1e-15);
}

TEST(BlinnPhong, is_brightest_where_the_half_vector_is_the_normal) {
  const auto shader = make_plugin<SurfaceShader>(
      "blinn_phong", {{"diffuse", Rgb(0.0)}, {"specular", Rgb(1.0)}, {"shininess", 50.0}});
  const Vec3d wi(0.6, 0.8, 0.0), wo(-0.6, 0.8, 0.0);
  const Illumination light{wi, 1.0, Rgb(1.0)};
  EXPECT_NEAR(shader->shade({Vec3d(0.0), kUp}, wo, {&light, 1}).x, 1.0 / std::numbers::pi, 1e-15);
  const Vec3d beside = normalize(wo + Vec3d(0.0, 0.0, 0.2)), h = normalize(wi + beside);
  EXPECT_NEAR(shader->shade({Vec3d(0.0), kUp}, beside, {&light, 1}).x, std::pow(h.y, 50) / std::numbers::pi,
              1e-14);
}

TEST(BlinnPhong, needs_four_times_the_shininess_of_phong) {
  const auto highlight = [](const char* name, double shininess, double angle) {
    const auto shader = make_plugin<SurfaceShader>(
        name, {{"diffuse", Rgb(0.0)}, {"specular", Rgb(1.0)}, {"shininess", shininess}});
    const Illumination light{kUp, 1.0, Rgb(1.0)};
    return shader->shade({Vec3d(0.0), kUp}, {std::sin(angle), std::cos(angle), 0.0}, {&light, 1}).x;
  };
  for (const double angle : {0.02, 0.05, 0.1}) {
    EXPECT_NEAR(highlight("blinn_phong", 400, angle) / highlight("phong", 100, angle), 1.0, 0.01);
  }
}

TEST(BlinnPhong, light_from_right_behind_gives_no_highlight) {
  const auto shader = make_plugin<SurfaceShader>("blinn_phong", {{"specular", Rgb(1.0)}});
  const Illumination light{{0.6, 0.8, 0.0}, 1.0, Rgb(1.0)};
  const Rgb seen = shader->shade({Vec3d(0.0), kUp}, -light.wi, {&light, 1});
  EXPECT_NEAR(seen.x, 0.8 * 0.8 / std::numbers::pi, 1e-15) << "the diffuse part alone";
}

TEST(Phong, mirrors_and_is_seen_through_where_asked) {
  EXPECT_TRUE(scattered(*make_plugin<SurfaceShader>("phong"), kUp, false).empty());
  const auto shader =
      make_plugin<SurfaceShader>("phong", {{"mirror", Rgb(0.25)}, {"transparency", Rgb(0.5)}, {"ior", 1.2}});
  const auto rays = scattered(*shader, {0.6, 0.8, 0.0}, false);
  ASSERT_EQ(rays.size(), 2u);
  EXPECT_NEAR(length(rays[0].d - Vec3d(-0.6, 0.8, 0.0)), 0.0, 1e-15);
  EXPECT_NEAR(rays[1].d.x, -0.5, 1e-15);
  EXPECT_EQ(rays[1].weight, Rgb(0.5));
  const auto nothing_passes = scattered(*shader, {0.96, 0.28, 0.0}, true);
  EXPECT_FALSE(nothing_passes[1].passes);
}

}  // namespace
}  // namespace pileus
