#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/fixtures/march_scenes.h"
#include "tests/fixtures/picture_scene.h"
#include "tests/fixtures/traced_scene.h"

namespace pileus {
namespace {

const std::string kSky = "[background]\ntype = \"gradient\"\nexponent = 2\n",
                  kWhite = "[background]\ntype = \"constant\"\nradiance = [1, 1, 1]\n",
                  kMirror = "shader = { type = \"phong\", diffuse = [0, 0, 0], mirror = [1, 1, 1] }\n",
                  kGlass = "shader = { type = \"glass\" }\n", kFloor = "[object.floor]\ntype = \"plane\"\n",
                  kBall = "[object.ball]\ntype = \"sphere\"\n",
                  kCloud = "[volume.cloud]\ntype = \"ellipsoid\"\ncenter = [0, 2, -3]\nextinction = 2\n",
                  kSun = "[light.sun]\ntype = \"sun\"\nirradiance = [3, 2, 1]\n";

double largest_difference(const Rgb& a, const Rgb& b) {
  const Rgb d = a - b;
  return std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
}

class Secondary : public testing::TestWithParam<const char*> {
 protected:
  static TracedScene scene(const std::string& text, double tolerance = 0.0) {
    return TracedScene(std::string("[render]\nintegrator = \"") + GetParam() + "\"\n" + text, tolerance);
  }
};
INSTANTIATE_TEST_SUITE_P(Rays, Secondary, testing::Values("exact", "uniform", "march"),
                         [](const auto& test) { return std::string(test.param); });

TEST_P(Secondary, a_mirror_shows_what_the_mirrored_ray_sees) {
  const TracedScene scene = this->scene(kSky + kSun + kCloud + kFloor + kMirror);
  const Vec3d d = normalize(Vec3d(0.1, -1.0, -1.2));
  const Ray ray{{0.1, 2.0, 2.5}, d};
  const Ray from_floor{ray.at(2.0 / -d.y) + Vec3d(0, 1e-12, 0), {d.x, -d.y, d.z}};
  EXPECT_LT(largest_difference(scene.trace(ray).radiance, scene.trace(from_floor).radiance), 2e-6);
  EXPECT_GT(
      largest_difference(scene.trace(from_floor).radiance, scene.world().background->radiance(from_floor.d)),
      0.01)
      << "the cloud is in sight";
  EXPECT_EQ(scene.trace(ray).transmittance, 0.0);
}

TEST_P(Secondary, glass_in_a_white_furnace_is_white) {
  const std::string form =
      "[freeform.egg]\nbase = { ellipsoid = { radii = [1, 1.4, 0.8] } }\n"
      "[object.egg]\ntype = \"freeform\"\nform = \"egg\"\n";
  for (const std::string& object : {kBall, form}) {
    for (const double ior : {1.0, 1.33, 2.4}) {
      const TracedScene scene = this->scene("max_bounces = 40\n" + kWhite + object +
                                            fmt::format("shader = {{ type = \"glass\", ior = {} }}\n", ior));
      for (const double x : {0.0, 0.3, 0.77}) {
        const Rgb seen = scene.trace({{x, 0.05, 5.0}, {0.0, 0.0, -1.0}}).radiance;
        EXPECT_NEAR(seen.x, 1.0, 2e-5) << object << ior << " " << x;
      }
    }
  }
}

TEST_P(Secondary, glass_absorbs_along_the_chord) {
  const TracedScene scene =
      this->scene(kWhite + kBall + "shader = { type = \"glass\", ior = 1, absorption = [0.5, 1, 0] }\n");
  for (const double x : {0.0, 0.5, 0.9}) {
    const double chord = 2.0 * std::sqrt(1.0 - x * x);
    const Rgb seen = scene.trace({{x, 0.0, 5.0}, {0.0, 0.0, -1.0}}).radiance;
    EXPECT_LT(largest_difference(seen, {std::exp(-0.5 * chord), std::exp(-chord), 1.0}), 1e-12) << x;
  }
  const Rgb from_inside = scene.trace({{0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}}).radiance;
  EXPECT_LT(largest_difference(from_inside, {std::exp(-0.5), std::exp(-1.0), 1.0}), 1e-12);
}

TEST_P(Secondary, what_is_in_glass_is_dimmed_by_the_way_to_it) {
  const TracedScene scene =
      this->scene(kBall + "shader = { type = \"glass\", ior = 1, absorption = [1, 1, 1] }\n" +
                  "[object.pearl]\ntype = \"sphere\"\nradius = 0.25\n"
                  "shader = { type = \"phong\", ambient = [1, 1, 1], ambient_radiance = [1, 1, 1] }\n");
  EXPECT_NEAR(scene.trace({{0.0, 0.0, 5.0}, {0.0, 0.0, -1.0}}).radiance.x, std::exp(-0.75), 1e-12);
}

TEST_P(Secondary, facing_mirrors_end_after_as_many_bounces_as_asked) {
  const auto hall = [&](int bounces) {
    return scene(
               fmt::format("max_bounces = {}\n", bounces) +
               "[object.a]\ntype = \"plane\"\npoint = [0, 0, -1]\nnormal = [0, 0, 1]\n"
               "shader = { type = \"phong\", mirror = [0.5, 0.5, 0.5], ambient = [1, 1, 1], ambient_radiance "
               "= [1, 1, 1] }\n"
               "[object.b]\ntype = \"plane\"\npoint = [0, 0, 9]\nnormal = [0, 0, 1]\n"
               "shader = { type = \"phong\", mirror = [0.5, 0.5, 0.5], ambient = [1, 1, 1], ambient_radiance "
               "= [1, 1, 1] }\n")
        .trace({{0.0, 0.0, 5.0}, normalize(Vec3d(0.01, 0.0, -1.0))})
        .radiance.x;
  };
  EXPECT_EQ(hall(0), 1.0);
  EXPECT_EQ(hall(1), 1.5);
  EXPECT_EQ(hall(5), 2.0 - std::exp2(-5));
  EXPECT_NEAR(hall(60), 2.0, 1e-6) << "what counts too little is not followed";
}

TEST_P(Secondary, the_disc_of_a_sun_is_seen_in_a_mirror) {
  const TracedScene scene = this->scene(kFloor + kMirror +
                                        "[light.sun]\ntype = \"sun\"\ndirection = [0, 1, -1]\n"
                                        "irradiance = [1, 1, 1]\ndisc_deg = 2\n");
  const double radiance = 1.0 / (std::numbers::pi * std::pow(std::sin(std::numbers::pi / 180.0), 2));
  const auto seen = [&](double degrees) {
    const double angle = (45.0 + degrees) * std::numbers::pi / 180.0;
    return scene.trace({{0.0, 3.0, 0.0}, {0.0, -std::sin(angle), -std::cos(angle)}}).radiance.x;
  };
  EXPECT_NEAR(seen(0.0), radiance, 1e-9);
  EXPECT_NEAR(seen(0.99), radiance, 1e-9);
  EXPECT_EQ(seen(1.01), 0.0);
}

TEST_P(Secondary, glass_throws_no_shadow) {
  const std::string matt = kSun + "[object.floor]\ntype = \"plane\"\npoint = [0, -3, 0]\n" + kBall;
  const Ray down{{-0.6, -1.9, -1.0}, {0.0, -1.0, 0.0}};  // behind the ball, seen from the sun
  EXPECT_EQ(scene(matt).trace(down).radiance, Rgb(0.0));
  EXPECT_GT(scene(matt + kGlass).trace(down).radiance.x, 0.1);
}

TEST_P(Secondary, the_sky_lights_surfaces_that_ask_for_it) {
  const std::string floor = kWhite + kFloor + "shader = { type = \"phong\", ambient = [0.5, 0.5, 0.5]";
  const Ray down{{0.0, 1.0, 0.0}, {0.0, -1.0, 0.0}};
  EXPECT_EQ(scene(floor + " }\n").trace(down).radiance, Rgb(0.0));
  EXPECT_NEAR(scene(floor + ", sky = 1 }\n").trace(down).radiance.x, 0.5, 1e-15);
}

TEST(SecondaryRays, integrators_agree_on_clouds_in_mirrors_and_behind_glass) {
  const MarchScenes scenes;
  const std::string text =
      scenes.camera("[0, 1, 8]", "[0, -0.3, 0]", 50) +
      scenes.grid("blob", "extinction = 3\ntranslate = [0.5, 0.6, -2]") + scenes.sun() + kSky +
      "[object.floor]\ntype = \"plane\"\npoint = [0, -1.5, 0]\n" +
      "shader = { type = \"phong\", diffuse = [0.3, 0.3, 0.3], mirror = [0.4, 0.4, 0.4] }\n" +
      "[object.ball]\ntype = \"sphere\"\ncenter = [-1.6, -0.4, 1]\n" + kMirror +
      "[object.lens]\ntype = \"sphere\"\ncenter = [1.6, -0.4, 1.5]\n" +
      "shader = { type = \"glass\", absorption = [0.3, 0.1, 0.05] }\n";
  const double tolerance = 0.004;
  const auto exact = PictureScene("\"exact\"", text, 1e-5).picture();
  const PictureScene march("\"march\"", text, tolerance);
  const auto marched = march.picture(16);
  const auto stepped = PictureScene("{ type = \"uniform\", step = 0.02 }", text, 1e-4).picture();
  for (size_t i = 0; i < exact.size(); ++i) {
    ASSERT_LT(largest_difference(marched[i].radiance, exact[i].radiance), tolerance) << i;
    ASSERT_LE(marched[i].error, tolerance * 1.000001) << i;
    ASSERT_LT(largest_difference(stepped[i].radiance, exact[i].radiance), 0.02) << i;
  }
  const auto again = march.picture(64);
  for (size_t i = 0; i < exact.size(); ++i) ASSERT_EQ(again[i].radiance, marched[i].radiance) << i;
}

}  // namespace
}  // namespace pileus
