// Radiances of the exact integrator against answers known on paper and against the slow twin.
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "lib/math/transmittance.h"
#include "tests/fixtures/picture_scene.h"
#include "tests/fixtures/random_grid.h"
#include "tests/fixtures/temp_folder.h"
#include "tests/fixtures/traced_scene.h"
#include "tests/reference/single_scattering.h"

namespace pileus {
namespace {

constexpr double kIsotropic = 0.25 * std::numbers::inv_pi;

struct SlabCase {
  double albedo, mu_sun, mu_view, tau;
};

/// Reflected radiance of a slab per unit irradiance of the beam, single isotropic scattering.
double slab_reflection(const SlabCase& c) {
  const double both = 1 / c.mu_view + 1 / c.mu_sun;
  return c.albedo * kIsotropic / (c.mu_view * both) * opacity_from_tau(c.tau * both);
}

TEST(ExactRadiance, slab_lit_by_a_sun) {
  // The catalogue's RAD-08 to RAD-10, and a thick one.
  const SlabCase cases[] = {{1, 1, 1, 0.1}, {0.9, 0.5, 0.8, 2}, {1, 0.25, 0.25, 1e-6}, {1, 0.7, 0.6, 500}};
  const double published[] = {0.0072124741695461302597, 0.027504634034889495896, 3.1830861294764123504e-7, 0};
  for (size_t i = 0; i < std::size(cases); ++i) {
    const SlabCase& c = cases[i];
    const TracedScene scene(fmt::format(R"(
[volume.slab]
type = "box"
min = [-1e7, 0, -1e7]
max = [1e7, 1, 1e7]
extinction = {}
albedo = [{}, 0.5, 0]
[light.sun]
type = "sun"
direction = [{}, {}, 0]
irradiance = [1, 1, 1]
)",
                                        c.tau, c.albedo, std::sqrt(1 - c.mu_sun * c.mu_sun), c.mu_sun));
    const RayResult result = scene.trace({{0, 2, 0}, {0, -c.mu_view, std::sqrt(1 - c.mu_view * c.mu_view)}});
    const double expected = slab_reflection(c);
    if (published[i] > 0) {
      EXPECT_NEAR(expected, published[i], 1e-12 * expected);
    }
    EXPECT_NEAR(result.radiance.x, expected, 1e-6 * expected) << i;
    EXPECT_NEAR(result.radiance.y, expected * 0.5 / c.albedo, 1e-6 * expected) << i;
    EXPECT_EQ(result.radiance.z, 0.0);
    EXPECT_LE(result.error, 1e-8 * expected);
  }
}

TEST(ExactRadiance, the_thin_lit_skin_of_a_dense_medium_is_found_at_every_tolerance) {
  for (const double extinction : {10.0, 70.0, 100.0, 1e3, 1e4, 1e8, 1e14, 1e30}) {
    for (const double tolerance : {0.05, 2e-3, 1e-4, 0.0}) {
      const TracedScene scene(fmt::format(R"(
[volume.slab]
type = "box"
min = [-1e3, -2, -1e3]
max = [1e3, 0, 1e3]
extinction = {}
[light.sun]
type = "sun"
direction = [0.6, 0.8, 0]
irradiance = [1, 1, 1]
)",
                                          extinction),
                              tolerance);
      const double expected = slab_reflection({1, 0.8, 1, 2 * extinction});
      const RayResult result = scene.trace({{0, 5, 0}, {0, -1, 0}});
      // Where the mean free path is below the rounding of positions, the estimate says that nothing is known.
      const double allowed = extinction < 1e9 ? std::max(0.1 * tolerance, 1e-6 * expected) : result.error;
      EXPECT_NEAR(result.radiance.x, expected, allowed) << extinction << " " << tolerance;
      if (tolerance > 0 && extinction < 1e9) {
        EXPECT_LE(result.error, tolerance);
      }
    }
  }
}

TEST(ExactRadiance, agrees_with_the_twin_on_random_grids) {
  const TempFolder folder;
  for (unsigned seed = 0; seed < 3; ++seed) {
    const auto grid = random_grid(4, seed);
    write_grid(folder / "grid.vdb", grid);
    const TracedScene scene(fmt::format(R"(
[volume.grid]
type = "vdb"
file = "{}"
extinction = 0.8
[light.sun]
type = "sun"
direction = [0.3, 0.8, 0.5]
irradiance = [1, 1, 1]
)",
                                        (folder / "grid.vdb").string()));
    const auto accessor = grid->getConstAccessor();
    const reference::SingleScattering twin(
        [&](int i, int j, int k) {
          return double(accessor.getValue({i, j, k}));
        },
        0, 3);
    const Vec3d wi = normalize(Vec3d(0.3, 0.8, 0.5));
    for (const Vec3d& d :
         {normalize(Vec3d(0.2, -0.1, -1)), normalize(Vec3d(1, 0.05, 0.3)), Vec3d(0, -1, 0)}) {
      const Ray ray{Vec3d(1.4, 1.7, 1.2) - 9.0 * d, d};
      const double expected = twin.radiance(ray, 0.8, wi, kIsotropic, 40);
      EXPECT_NEAR(scene.trace(ray).radiance.x, expected, 1e-6 * expected) << seed;
    }
  }
}

TEST(ExactRadiance, stays_within_its_tolerance) {
  const TempFolder folder;
  write_grid(folder / "grid.vdb", random_grid(14, 4));
  const std::string text = fmt::format(R"(
[volume.grid]
type = "vdb"
file = "{}"
extinction = 0.6
phase = {{ type = "hg", g = 0.5 }}
[light.sun]
type = "sun"
direction = [0.3, 0.8, 0.5]
irradiance = [20, 15, 10]
[light.lamp]
type = "point"
position = [7, 20, 7]
intensity = [300, 500, 900]
[object.ball]
type = "sphere"
center = [7, 17, 7]
radius = 1.5
)",
                                       (folder / "grid.vdb").string());
  const TracedScene tight(text, 1e-7);
  for (const double tolerance : {0.05, 0.002, 1e-4}) {
    const TracedScene loose(text, tolerance);
    for (int n = 0; n < 60; ++n) {
      const Ray ray{{-20, 7 + 0.3 * (n % 12), 12}, normalize(Vec3d(1, 0.02 * n - 0.6, -0.3))};
      const RayResult a = loose.trace(ray), b = tight.trace(ray);
      EXPECT_LE(a.error, tolerance);
      for (int channel = 0; channel < 3; ++channel) {
        EXPECT_NEAR(a.radiance[channel], b.radiance[channel], tolerance) << "ray " << n;
      }
    }
  }
}

TEST(ExactRadiance, emission_alone_and_where_media_overlap) {
  const auto box = [](const char* name, double extinction, double emission) {
    return fmt::format(R"(
[volume.{}]
type = "box"
min = [0, -1, -1]
max = [3, 1, 1]
extinction = {}
albedo = [0, 0, 0]
emission = [{}, 0, 0]
)",
                       name, extinction, emission);
  };
  const Ray ray{{-5, 0, 0}, {1, 0, 0}};
  const auto radiance = [&](const std::string& text) { return TracedScene(text).trace(ray).radiance.x; };
  EXPECT_NEAR(radiance(box("a", 0, 2)), 6.0, 1e-12);
  EXPECT_NEAR(radiance(box("a", 0.5, 2)), 2 / 0.5 * -std::expm1(-1.5), 1e-12);
  EXPECT_NEAR(radiance(box("a", 0.5, 2) + box("b", 0.25, 1)), 3 / 0.75 * -std::expm1(-2.25), 1e-10);
  EXPECT_NEAR(radiance(box("a", 50, 2) + box("b", 0, 1)), 3.0 / 50, 1e-10);
}

TEST(ExactRadiance, emission_of_overlapping_media_that_are_dense_or_steep) {
  const auto radiance = [](double extinction) {
    return TracedScene(fmt::format(R"(
[volume.fog]
type = "height_fog"
base = 0
scale_height = 0.02
top = 500
extent = 5
extinction = {}
albedo = [0, 0, 0]
emission = [2, 0, 0]
[volume.box]
type = "box"
min = [-1, 0, -1]
max = [1, 10, 1]
extinction = {}
albedo = [0, 0, 0]
emission = [2, 0, 0]
)",
                                   extinction, extinction))
        .trace({{0, 20, 0}, {0, -1, 0}})
        .radiance.x;
  };
  // Both have the source 2 / extinction, so their sum has it too.
  for (const double extinction : {1e-3, 1.0, 1e3}) {
    const double tau = extinction * (10 + 0.02 * -std::expm1(-500.0));
    const double expected = 2 / extinction * opacity_from_tau(tau);
    EXPECT_NEAR(radiance(extinction), expected, 1e-6 * expected) << extinction;
  }
}

TEST(ExactRadiance, a_thin_plume_over_haze_casts_its_shadow) {
  const TracedScene scene(R"(
[volume.haze]
type = "box"
min = [-500, -1, -500]
max = [500, 0, 500]
extinction = 1e-3
[volume.plume]
type = "box"
min = [120, 5, -500]
max = [170, 6, 500]
extinction = 1e3
albedo = [0, 0, 0]
[light.sun]
type = "sun"
direction = [0, 1, 0]
irradiance = [1, 1, 1]
)",
                          1e-6);
  // Along x at y = -0.5: the sun is gone for 120 < x < 170.
  const double sigma = 1e-3;
  const auto until = [&](double x) { return opacity_from_tau(sigma * (x + 500)); };
  const double expected = kIsotropic * std::exp(-sigma * 0.5) * (until(500) - (until(170) - until(120)));
  EXPECT_NEAR(scene.trace({{-600, -0.5, 0}, {1, 0, 0}}).radiance.x, expected, 1e-6);
}

TEST(ExactRadiance, camera_inside_a_medium) {
  const TracedScene scene(R"(
[background]
type = "constant"
radiance = [4, 4, 4]
[volume.box]
type = "box"
extinction = 0.5
albedo = [0, 0, 0]
)");
  EXPECT_NEAR(scene.trace({{0.25, 0, 0}, {1, 0, 0}}).radiance.x, 4 * std::exp(-0.375), 1e-12);
}

TEST(ExactRadiance, surfaces_are_veiled_and_shadowed_by_media) {
  const TracedScene scene(R"(
[volume.box]
type = "box"
min = [-1, 1, -1]
max = [1, 3, 1]
extinction = 0.4
albedo = [0, 0, 0]
[object.ground]
type = "plane"
shader = { type = "phong", diffuse = [1, 1, 1], specular = [0, 0, 0], ambient = [0, 0, 0] }
[light.sun]
type = "sun"
direction = [0, 1, 0]
irradiance = [3, 3, 3]
)");
  const double lit = 3 * std::numbers::inv_pi;
  const auto ground_seen_from = [&](const Vec3d& eye, const Vec3d& p) {
    return scene.trace({eye, normalize(p - eye)}).radiance.x;
  };
  EXPECT_NEAR(ground_seen_from({5, 9, 0}, {5, 0, 0}), lit, 1e-12);                         // open ground
  EXPECT_NEAR(ground_seen_from({5, 0.5, 0}, {0.5, 0, 0}), lit * std::exp(-0.8), 1e-12);    // shadowed
  EXPECT_NEAR(ground_seen_from({-0.5, 9, 0}, {-0.5, 0, 0}), lit * std::exp(-1.6), 1e-12);  // and veiled
  EXPECT_NEAR(ground_seen_from({2, 4, 0}, {-2, 0, 0}), lit * std::exp(-0.4 * std::sqrt(8)),
              1e-12);  // veiled only
}

TEST(ExactRadiance, a_sphere_cuts_a_sharp_shaft_through_fog) {
  const TracedScene scene(R"(
[volume.fog]
type = "box"
min = [-50, -50, -50]
max = [50, 50, 50]
extinction = 1e-3
[object.ball]
type = "sphere"
center = [0, 10, 0]
radius = 2
[light.sun]
type = "sun"
direction = [0, 1, 0]
irradiance = [1, 1, 1]
)");
  // Along x at y = 0 the shadow is the stretch |x| < 2; sun depth sigma * 50, view depth sigma * (x + 50).
  const RayResult result = scene.trace({{-60, 0, 0}, {1, 0, 0}});
  const double sigma = 1e-3;
  const auto until = [&](double x) { return opacity_from_tau(sigma * (x + 50)); };
  const double expected = kIsotropic * std::exp(-sigma * 50) * (until(50) - (until(2) - until(-2)));
  EXPECT_NEAR(result.radiance.x, expected, 1e-7 * expected);
  EXPECT_LT(result.samples, 2000u);  // the edges are known, not searched
}

TEST(ExactRadiance, keeps_its_tolerance_where_media_have_edges_in_each_other) {
  const std::string text = R"([camera]
type = "perspective"
position = [0, 0.3, 8]
look_at = [0, 0, 0]
fov_deg = 40
[light.sun]
type = "sun"
direction = [0.3, 0.8, 0.5]
irradiance = [9, 8, 7]
[volume.large]
type = "ellipsoid"
radii = [2.2, 1.5, 1.2]
extinction = 0.8
albedo = [0.9, 0.2, 0.1]
[volume.small]
type = "ellipsoid"
center = [0.4, 0.2, 0.1]
radii = [0.9, 1.1, 0.7]
extinction = 2.5
albedo = [0.1, 0.3, 0.95]
)";
  constexpr double kTolerance = 3e-4;
  const Vec2i size(64, 40);
  const auto rough = PictureScene("\"exact\"", text, kTolerance, size).picture();
  const auto fine = PictureScene("\"exact\"", text, 1e-8, size).picture();
  for (size_t i = 0; i < rough.size(); ++i) {
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(rough[i].radiance[c], fine[i].radiance[c], kTolerance) << i;
  }
}

TEST(ExactRadiance, depth_planes) {
  const TracedScene scene(R"(
[volume.box]
type = "box"
extinction = 2
)");
  const RayResult hit = scene.trace({{0, 0, 5}, {0, 0, -1}}), miss = scene.trace({{0, 5, 5}, {0, 0, -1}});
  EXPECT_NEAR(hit.z_first, 4.0, 1e-12);
  EXPECT_NEAR(hit.z_half, 4.0 + std::log(2) / 2, 1e-12);
  EXPECT_NEAR(hit.transmittance, std::exp(-4), 1e-14);
  EXPECT_TRUE(std::isinf(miss.z_first) && std::isinf(miss.z_half));
  EXPECT_EQ(miss.transmittance, 1.0);
}

/// The shadow of a volume of 4 m around (139, 5, 2) on a way of 1 km through haze, against many small steps.
void expect_shadow_on_haze(const std::string& volume) {
  const PictureScene scene("\"exact\"",
                           fmt::format(R"(
[camera]
type = "perspective"
[light.sun]
type = "sun"
direction = [0.3, 0.8, 0.1]
irradiance = [5, 5, 5]
{}[volume.haze]
type = "box"
min = [-1000, -1, -1000]
max = [1000, 10, 1000]
extinction = 0.002
)",
                                       volume),
                           1e-6);
  const Ray ray{{0.5, 0, 0}, {1, 0, 0}};
  const Vec3d towards_sun = normalize(Vec3d(0.3, 0.8, 0.1));
  FieldCounters counters;
  double expected = 0.0, in_shadow = 0.0;
  const auto add = [&](double from, double to, int steps) {
    const double step = (to - from) / steps;
    for (int n = 0; n < steps; ++n) {
      const double t = from + (n + 0.5) * step;
      double depth = 0.0;
      for (const WorldMedium& medium : scene.world().media)
        depth +=
            medium.extinction * medium.density->column({ray.at(t), towards_sun}, {0, 1e9}, 1e9, counters);
      const double light = 0.002 * step * transmittance(0.002 * t) * 5 * kIsotropic;
      expected += light * transmittance(depth);
      in_shadow += depth > 0.1 ? light : 0.0;
    }
  };
  add(0, 100, 1000);
  add(100, 200, 100000);
  add(200, 999.5, 1000);
  ASSERT_GT(in_shadow, 1e-3);
  const RayResult result = scene.trace({ray})[0];
  EXPECT_NEAR(result.radiance.x, expected, 2e-6);
}

TEST(ExactRadiance, shadows_of_small_grids_on_haze_are_not_overlooked) {
  TempFolder folder;
  const auto grid = random_grid(16, 51);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  write_grid(folder / "grid.vdb", grid);
  expect_shadow_on_haze(
      fmt::format("[volume.grid]\ntype = \"vdb\"\nfile = \"{}\"\nextinction = 2\ntranslate = [137, 3, 0]\n",
                  (folder / "grid.vdb").string()));
}

TEST(ExactRadiance, shadows_of_small_hazes_on_others_are_not_overlooked) {
  expect_shadow_on_haze(
      "[volume.ball]\ntype = \"ellipsoid\"\ncenter = [139, 5, 1]\nradii = [2, 2, 2]\nextinction = 2\n");
}

}  // namespace
}  // namespace pileus
