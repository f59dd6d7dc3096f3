#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "lib/scene/surface_shader.h"
#include "tests/shaders_cpu/make_plugin.h"

namespace pileus {
namespace {

const Vec3d kUp(0, 1, 0);

std::shared_ptr<SurfaceShader> ggx(double base, double roughness, double metallic, double ior = 1.5) {
  return make_plugin<SurfaceShader>(
      "ggx", {{"base_color", Rgb(base)}, {"roughness", roughness}, {"metallic", metallic}, {"ior", ior}});
}

Vec3d direction(double cosine, double azimuth = 0.0) {
  const double sine = std::sqrt((1.0 - cosine) * (1.0 + cosine));
  return {sine * std::cos(azimuth), cosine, sine * std::sin(azimuth)};
}

/// What leaves towards wo for light of irradiance 1 from wi, per cosine: the reflection function [1/sr].
double f(const SurfaceShader& shader, const Vec3d& wo, const Vec3d& wi) {
  const Illumination light{wi, 1.0, Rgb(1.0)};
  return shader.shade({Vec3d(0.0), kUp}, wo, {&light, 1}).x / wi.y;
}

/// What a white furnace of radiance 1 shows: the midpoint rule over the hemisphere, in directions of the half
/// vector, where highlights are smooth, with weights that make both maps agree.
double albedo(const SurfaceShader& shader, double roughness, double cosine_o) {
  const Vec3d wo = direction(cosine_o);
  const double alpha2 = std::max(std::pow(roughness, 4), 1e-8);
  const int rings = 128, spokes = 128;
  double sum = 0.0;
  for (int i = 0; i < rings; ++i) {
    // Half of the samples follow the highlight, half the cosine; the balance heuristic joins them.
    for (int j = 0; j < spokes; ++j) {
      const double u = (i + 0.5) / rings, azimuth = 2.0 * std::numbers::pi * (j + 0.5) / spokes;
      const auto pdf = [&](const Vec3d& wi) {
        const Vec3d h = normalize(wo + wi);
        const double off = h.y * h.y * (alpha2 - 1.0) + 1.0;
        const double d = alpha2 / (std::numbers::pi * off * off);
        return 0.5 * wi.y * std::numbers::inv_pi + 0.5 * d * h.y / (4.0 * dot(wo, h));
      };
      const Vec3d h = direction(std::sqrt((1.0 - u) / (1.0 + (alpha2 - 1.0) * u)), azimuth);
      const Vec3d by_highlight = 2.0 * dot(wo, h) * h - wo, by_cosine = direction(std::sqrt(u), azimuth);
      for (const Vec3d& wi : {by_highlight, by_cosine}) {
        if (wi.y > 1e-9 && dot(wo, normalize(wo + wi)) > 0.0) sum += 0.5 * f(shader, wo, wi) * wi.y / pdf(wi);
      }
    }
  }
  return sum / (rings * spokes);
}

TEST(Ggx, reflects_no_more_than_it_gets) {
  for (const double roughness : {0.05, 0.2, 0.5, 1.0}) {
    for (const double metallic : {0.0, 0.5, 1.0}) {
      for (const double ior : {1.0, 1.5, 2.5}) {
        for (const double cosine : {1.0, 0.6, 0.2, 0.03}) {
          const double share = albedo(*ggx(1.0, roughness, metallic, ior), roughness, cosine);
          EXPECT_LE(share, 1.0 + 2e-3) << roughness << " " << metallic << " " << ior << " " << cosine;
          EXPECT_GT(share, 0.15) << roughness << " " << metallic << " " << ior << " " << cosine;
        }
      }
    }
  }
}

TEST(Ggx, smooth_metal_reflects_all_that_its_colour_allows) {
  EXPECT_NEAR(albedo(*ggx(1.0, 0.1, 1.0), 0.1, 0.9), 1.0, 3e-3);
  EXPECT_NEAR(albedo(*ggx(0.0, 0.1, 0.0), 0.1, 1.0), 0.04, 1e-3);
}

TEST(Ggx, light_may_go_either_way) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(0.01, 1.0);
  for (int i = 0; i < 2000; ++i) {
    const auto shader = ggx(any(random), any(random), any(random), 1.0 + any(random));
    const Vec3d a = direction(any(random), 6.0 * any(random)), b = direction(any(random), 6.0 * any(random));
    const double there = f(*shader, a, b), back = f(*shader, b, a);
    ASSERT_NEAR(there, back, 1e-11 * (there + back));
    ASSERT_GE(there, 0.0);
  }
}

TEST(Ggx, a_smooth_coat_is_a_mirror) {
  const SurfacePoint point{Vec3d(0.0), kUp};
  std::vector<ScatteredRay> rays;
  ggx(0.5, 0.0, 1.0)->append_scattered(point, direction(1.0), rays);
  ASSERT_EQ(rays.size(), 1u);
  EXPECT_EQ(rays[0].weight, Rgb(0.5));
  EXPECT_FALSE(rays[0].passes);
  EXPECT_FALSE(ggx(0.5, 0.1, 1.0)->is_mirror());
  EXPECT_EQ(f(*ggx(0.5, 0.0, 1.0), direction(1.0), direction(1.0)), 0.0) << "a lamp is a point to a mirror";
}

TEST(Ggx, stays_a_number_at_its_limits) {
  for (const double roughness : {0.0, 1e-200, 1e-6, 1.0}) {
    for (const double cosine : {1.0, 1e-12, 5e-324}) {
      const double value = f(*ggx(0.7, roughness, 0.5), direction(cosine, 3.0), direction(0.4));
      EXPECT_TRUE(std::isfinite(value) && value >= 0.0) << roughness << " " << cosine;
    }
  }
  EXPECT_TRUE(std::isfinite(f(*ggx(0.7, 1e-200, 0.5), kUp, kUp)));
}

TEST(Ggx, receives_light_of_the_sky) {
  const auto shader = make_plugin<SurfaceShader>("ggx", {{"base_color", Rgb(1.0)}, {"sky", 1.0}});
  ASSERT_TRUE(shader->wants_sky());
  SurfacePoint point{Vec3d(0.0), kUp};
  point.sky = Rgb(std::numbers::pi);
  EXPECT_NEAR(shader->shade(point, kUp, {}).x, 1.0, 1e-15);
}

}  // namespace
}  // namespace pileus
