// Fog in front of, around and behind what rays show: every integrator evaluates the same formula,
//   L = integral of T_media sigma (T_fog L_media + C_fog) dt + T_media (T_fog L_end + C_fog).
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "integrators/march_fog.h"
#include "integrators/ray_fog.h"
#include "tests/fixtures/march_scenes.h"
#include "tests/fixtures/picture_scene.h"
#include "tests/fixtures/traced_scene.h"

namespace pileus {
namespace {

const std::string kExact = "[render]\nintegrator = \"exact\"\n",
                  kUniform = "[render]\nintegrator = { type = \"uniform\", step = 0.001 }\n",
                  kSky = "[background]\ntype = \"constant\"\nradiance = [0.3, 0.5, 0.9]\n";

void expect_near(const Rgb& got, const Rgb& expected, double tolerance, const std::string& what = "") {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[c], expected[c], tolerance) << what << ", channel " << c;
}

double difference(const Rgb& a, const Rgb& b) {
  const Rgb d = a - b;
  return std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
}

const Ray kAhead{{0.0, 0.0, 5.0}, {0.0, 0.0, -1.0}};

TEST(Fog, dims_the_background_and_a_solid_by_its_distance) {
  const std::string fog = "[fog.f]\ntype = \"distance\"\ndensity = 0.1\ncolour = [0.2, 0.4, 0.6]\n";
  const std::string ball =
      "[object.ball]\ntype = \"sphere\"\nradius = 1\nshader = { type = \"phong\", diffuse = [0, 0, 0], "
      "ambient = "
      "[1, 1, 1], ambient_radiance = [0.9, 0.7, 0.1] }\n";
  for (const std::string& integrator :
       {kExact, kUniform, std::string("[render]\nintegrator = \"march\"\n")}) {
    const RayResult sky = TracedScene(integrator + kSky + fog, 1e-3).trace(kAhead);
    expect_near(sky.radiance, {0.2, 0.4, 0.6}, 1e-15, integrator);
    EXPECT_EQ(sky.transmittance, 0.0);
    const RayResult hit = TracedScene(integrator + kSky + fog + ball, 1e-3).trace(kAhead);
    const double fade = std::exp(-0.4);
    expect_near(hit.radiance, fade * Rgb(0.9, 0.7, 0.1) + (1.0 - fade) * Rgb(0.2, 0.4, 0.6), 1e-14,
                integrator);
    EXPECT_NEAR(hit.z_first, 4.0, 1e-12) << "depth is that of the solid";
  }
}

TEST(Fog, alpha_counts_it) {
  const RayResult sky =
      TracedScene(kExact + "[fog.f]\ntype = \"height\"\nextinction = 0.01\nscale_height = 20\n")
          .trace({{0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}});
  EXPECT_NEAR(sky.transmittance, std::exp(-0.2), 1e-15);
}

/// A homogeneous box in homogeneous fog, known on paper: 4 m of fog, 2 m of both, fog for ever.
TEST(Fog, around_an_absorbing_and_glowing_box_is_known_on_paper) {
  const std::string scene = kSky +
                            "[fog.f]\ntype = \"distance\"\ndensity = 0.1\ncolour = [0.2, 0.4, 0.6]\n"
                            "[volume.box]\ntype = \"box\"\nextinction = 0.7\nalbedo = [0, 0, 0]\n";
  const Rgb fog(0.2, 0.4, 0.6), glow(0.5, 0.1, 0.3);
  const auto seen = [&](const Rgb& emission) {
    const double before = std::exp(-0.4), both = 0.8, through = std::exp(-1.6);
    return fog * (1.0 - before) + (0.1 * fog + emission) * (before * (1.0 - through) / both) +
           fog * (before * through);
  };
  const std::string glowing = scene + "emission = [0.5, 0.1, 0.3]\n";
  expect_near(TracedScene(kExact + scene).trace(kAhead).radiance, seen(Rgb(0.0)), 1e-10);
  expect_near(TracedScene(kExact + glowing).trace(kAhead).radiance, seen(glow), 1e-10);
  expect_near(TracedScene(kUniform + scene).trace(kAhead).radiance, seen(Rgb(0.0)), 1e-7);
  expect_near(TracedScene(kUniform + glowing).trace(kAhead).radiance, seen(glow), 1e-7);
}

/// How far the fog of a picture of 640 x 360, interpolated between corners of tiles, is off the law: what
/// shows.
double worst_between_corners(const std::string& scene, const std::string& fog) {
  const TracedScene corners(scene + fog + "per = \"vertex\"\n"), law(scene + fog);
  const Vec2i picture(640, 360);
  const FogSetup with_corners(corners.world(), 0.002, picture), exact(law.world(), 0.002, picture);
  RayFog between(with_corners), at(exact);
  double worst = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const Ray ray = law.world().camera->ray(Vec2d(i % 641, i * 37 % 361), picture);
    const auto hit = nearest_surface(law.world(), ray, {0.0, std::numeric_limits<double>::infinity()});
    const double end = hit ? hit->t : std::numeric_limits<double>::infinity();
    between.build(ray, end, true), at.build(ray, end, true);
    worst = std::max(worst, std::abs(between.end().transmittance - at.end().transmittance));
  }
  return worst;
}

TEST(Fog, between_corners_is_off_as_far_as_told) {
  const std::string fog = "[fog.f]\ntype = \"distance\"\ndensity = 0.02\n",
                    wall = "[object.wall]\ntype = \"plane\"\npoint = [0, 0, -40]\nnormal = [0.3, 0.2, 1]\n",
                    ball = "[object.ball]\ntype = \"sphere\"\nradius = 1\n",
                    plain = "[object.plain]\ntype = \"plane\"\npoint = [0, -2, 0]\n";
  EXPECT_LT(worst_between_corners(wall, fog), 2e-4) << "a wall";
  EXPECT_LT(worst_between_corners(wall, fog + "measure = \"planar\"\n"), 2e-4) << "a wall";
  const double horizon = worst_between_corners(plain, fog);
  EXPECT_LT(horizon, 0.1) << "a plain up to the horizon";
  // Where a tile shows two things: all the difference between them.
  const double edge = worst_between_corners(wall + ball, fog);
  EXPECT_LT(edge, std::exp(-0.02 * 4.0) - std::exp(-0.02 * 80.0));
  EXPECT_GT(edge, 0.3);
  RecordProperty("horizon", std::to_string(horizon));
}

TEST(Fog, does_not_dim_the_light_on_its_way) {
  const std::string scene =
      "[light.sun]\ntype = \"sun\"\ndirection = [0, 0, 1]\nirradiance = [3, 3, 3]\n"
      "[object.wall]\ntype = \"plane\"\npoint = [0, 0, 4.999]\nnormal = [0, 0, 1]\n"
      "shader = { type = \"phong\", diffuse = [1, 1, 1] }\n";
  const std::string fog = "[fog.f]\ntype = \"distance\"\ndensity = 10\n";
  const double seen = TracedScene(kExact + scene).trace(kAhead).radiance.x,
               in_fog = TracedScene(kExact + scene + fog).trace(kAhead).radiance.x;
  EXPECT_NEAR(in_fog, seen * std::exp(-0.01) + 0.6 * (1.0 - std::exp(-0.01)), 1e-6);
}

const std::string kMixedFog =
    "[fog.haze]\ntype = \"distance\"\ndensity = 0.04\ncolour = [0.5, 0.6, 0.8]\n"
    "[fog.ground]\ntype = \"height\"\nbase = -2\nscale_height = 1\nextinction = 0.2\ncolour = [0.8, 0.8, "
    "0.7]\n"
    "[fog.wisp]\ntype = \"layer\"\ncenter = [0.5, 0.3, 1]\nradii = [2, 0.5, 1.5]\nextinction = 0.3\n";

TEST(Fog, exact_and_uniform_agree_on_lit_clouds_in_any_fog) {
  const std::string cloud =
      "[volume.ball]\ntype = \"ellipsoid\"\nradii = [1.5, 1, 1]\nextinction = 1.2\nalbedo = [1, 0.9, 0.5]\n"
      "ambient = { top = [0.2, 0.3, 0.4], bottom = [0.1, 0.1, 0.1] }\nemission = [0, 0.1, 0]\n"
      "[light.sun]\ntype = \"sun\"\ndirection = [0.3, 0.8, 0.5]\nirradiance = [9, 8, 7]\n"
      "[object.ball]\ntype = \"sphere\"\ncenter = [0, 0, -3]\nradius = 1\n";
  const std::string steps = "[render]\nintegrator = { type = \"uniform\", step = 0.01 }\n";
  for (const std::string& fog :
       {std::string("[fog.f]\ntype = \"distance\"\nlaw = \"exponential_squared\"\ndensity = 0.1\n"),
        std::string("[fog.f]\ntype = \"distance\"\nlaw = \"linear\"\nstart = 3\nend = 5.2\n"),
        std::string(
            "[fog.f]\ntype = \"sunlit_layer\"\nbase = -3\nthickness = 4\nextinction = 0.1\nsun = \"sun\"\n"),
        kMixedFog}) {
    const TracedScene exact(kExact + kSky + fog + cloud, 1e-6), uniform(steps + kSky + fog + cloud);
    for (const Vec3d& d :
         {Vec3d(0, 0, -1), Vec3d(0.15, 0.1, -1), Vec3d(-0.2, -0.15, -1), Vec3d(0.05, -0.1, -1)}) {
      const Ray ray{{0.0, 0.2, 5.0}, normalize(d)};
      expect_near(exact.trace(ray).radiance, uniform.trace(ray).radiance, 2e-3, fog);
    }
  }
}

TEST(Fog, march_keeps_its_tolerance_and_its_own_rays) {
  const MarchScenes scenes;
  for (const std::string name : {"blob", "overlapping", "solids"}) {
    const std::string text = scenes.text_of(name) + kMixedFog;
    const PictureScene exact("\"exact\"", text, 2e-4);
    const std::vector<RayResult> expected = exact.picture(64);
    for (const double tolerance : {0.01, 0.003}) {
      const PictureScene march("\"march\"", text, tolerance);
      std::vector<RayResult> got(march.rays().size());
      Counters counters;
      march.tracer().trace(march.rays(), got, counters);
      double worst = 0.0;
      for (size_t i = 0; i < got.size(); ++i) {
        worst = std::max(worst, difference(got[i].radiance, expected[i].radiance));
        EXPECT_NEAR(got[i].transmittance, expected[i].transmittance, 3.0 * tolerance);
      }
      EXPECT_LE(worst, tolerance + 2e-4) << name;
      EXPECT_LT(counters["exact_rays"], got.size() / 10) << name << " at " << tolerance;
      EXPECT_GT(counters["fog_veils"], got.size()) << name;
    }
  }
}

TEST(Fog, march_errs_by_no_more_than_its_bound_through_several) {
  const MarchScenes scenes;
  const std::string text = scenes.text_of("blob") + kMixedFog;
  const PictureScene exact("\"exact\"", text, 2e-4);
  const PictureScene march("\"march\"", "aovs = \"beauty, error_bound\"\n" + text, 0.01);
  const std::vector<RayResult> expected = exact.picture(64), got = march.picture(64);
  for (size_t i = 0; i < got.size(); ++i) {
    EXPECT_LE(difference(got[i].radiance, expected[i].radiance), got[i].bound + 2e-4) << i;
    EXPECT_LT(got[i].bound, 0.02) << i;
  }
}

/// Tables of march against the fog itself, between nodes, too; with edges of fogs inside, and fogs in fogs.
TEST(FogTable, errs_as_it_says) {
  const std::string fogs[] = {
      "[fog.a]\ntype = \"distance\"\ndensity = 0.002\n",
      "[fog.b]\ntype = \"height\"\nextinction = 0.004\nscale_height = 25\n",
      "[fog.c]\ntype = \"layer\"\ncenter = [0, 20, -300]\nradii = [200, 30, 200]\nextinction = 0.002\n"
      "extinction_top = 0.02\n",
      "[fog.d]\ntype = \"sunlit_layer\"\nthickness = 50\nextinction = 0.01\nsun = \"sun\"\n",
  };
  std::mt19937 random(61);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  for (int which = 1; which < 16; ++which) {
    std::string text =
        "pileus = 1\n[camera]\ntype = \"perspective\"\nposition = [0, 30, 0]\nlook_at = [0, 20, -100]\n"
        "[light.sun]\ntype = \"sun\"\n";
    for (int n = 0; n < 4; ++n) text += which >> n & 1 ? fogs[n] : "";
    const World world = build_world(parse_scene(text, "fogs.toml", ""));
    const FogSetup setup(world, 0.002, {640, 360});
    RayFog fog(setup);
    MarchFog table;
    for (int ray = 0; ray < 12; ++ray) {
      fog.build(world.camera->ray({640.0 * any(random), 360.0 * any(random)}, {640, 360}), 900.0, true);
      const double allowed = ray % 2 == 0 ? 4e-5 : 1e-3;
      const MarchFogError told = tabulate(fog, {100.0, 900.0}, allowed, table);
      const double error = std::max(told.transmittance, told.light), most = 2.0 * error + 0.25 * allowed;
      const bool has_sharp_edges = (which & 12) != 0;  // of layers: there is an end to how fine tables are
      if (!has_sharp_edges) {
        EXPECT_LE(error, allowed) << which;
      }
      for (int n = 0; n < 300; ++n) {
        const double t = 100.0 + 800.0 * any(random), at = (t - table.t0) * table.nodes_per_metre;
        const size_t k = std::min(size_t(at), table.nodes.size() - 2);
        const Veil veil = fog.to(t);
        const double exact[4] = {veil.transmittance, veil.light.x, veil.light.y, veil.light.z};
        for (size_t c = 0; c < 4; ++c) {
          const double linear =
              double(table.nodes[k][c]) +
              (at - double(k)) * (double(table.nodes[k + 1][c]) - double(table.nodes[k][c]));
          ASSERT_NEAR(linear, exact[c], most) << which << " at " << t << ", channel " << c;
        }
      }
    }
  }
}

}  // namespace
}  // namespace pileus
