// Shadows of surfaces that textures make less than opaque, on surfaces and in media, against what is known on
// paper.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "integrators/hole_edges.h"
#include "tests/fixtures/picture_scene.h"
#include "tests/fixtures/traced_scene.h"

namespace pileus {
namespace {

const std::string
    kNoon = "[light.sun]\ntype = \"sun\"\ndirection = [0, 1, 0]\nirradiance = [3, 3, 3]\n",
    kGround = "[object.ground]\ntype = \"plane\"\nshader = { type = \"phong\", diffuse = [1, 1, 1] }\n";

/// Both colours the same: as opaque everywhere.
std::string even(double opacity) {
  return fmt::format(
      "[texture.veil]\ntype = \"checker\"\nopacity = \"luminance\"\ncolor_a = [{0}, {0}, {0}]\ncolor_b = "
      "[{0}, {0}, "
      "{0}]\n",
      opacity);
}

/// Squares of 1 m, or of `side`, opaque and holes by turns.
std::string board(double side = 1.0) {
  return fmt::format(
      "[texture.veil]\ntype = \"checker\"\nopacity = \"luminance\"\ncolor_a = [1, 1, 1]\ncolor_b = [0, 0, "
      "0]\n"
      "scale = [{0}, {0}, {0}]\n",
      8.0 * side);
}

std::string sheet(double height) {
  return fmt::format(
      "[object.sheet]\ntype = \"plane\"\npoint = [0, {}, 0]\nshader = {{ type = \"phong\", diffuse = [0.2, "
      "0.2, 0.2], opacity_texture = "
      "\"veil\" "
      "}}\n",
      height);
}

class HoleShadows : public testing::TestWithParam<const char*> {
 protected:
  static TracedScene scene(const std::string& text, double tolerance = 0.0) {
    return TracedScene(std::string("[render]\nintegrator = ") + GetParam() + "\n" + text, tolerance);
  }
};
INSTANTIATE_TEST_SUITE_P(Rays, HoleShadows,
                         testing::Values("\"exact\"", "{ type = \"uniform\", step = 0.002 }", "\"march\""),
                         [](const auto& test) { return "of_" + std::to_string(test.index); });

double lit_ground(const TracedScene& scene, double x, double z) {
  const Vec3d from(x + 0.2, 0.5, z);
  return scene.trace({from, normalize(Vec3d(x, 0, z) - from)}).radiance.x * std::numbers::pi / 3.0;
}

TEST_P(HoleShadows, a_sheet_lets_through_what_it_does_not_hold_back) {
  for (const double opacity : {0.0, 0.25, 0.7, 1.0})
    EXPECT_NEAR(lit_ground(scene(kNoon + kGround + even(opacity) + sheet(1.0)), 0.3, 0.4), 1.0 - opacity,
                1e-12);
}

TEST_P(HoleShadows, light_that_passes_two_sides_is_dimmed_twice) {
  const std::string shell =
      "[object.shell]\ntype = \"sphere\"\ncenter = [0, 3, 0]\nshader = { type = \"phong\", opacity_texture = "
      "\"veil\" "
      "}\n";
  const TracedScene scene = this->scene(kNoon + kGround + even(0.3) + shell + sheet(1.0));
  EXPECT_NEAR(lit_ground(scene, 0.2, 0.1), 0.7 * 0.7 * 0.7, 1e-12);
  EXPECT_NEAR(lit_ground(scene, 1.5, 0.1), 0.7, 1e-12) << "beside the shell";
}

TEST_P(HoleShadows, holes_of_a_sheet_lie_on_the_ground_as_on_the_sheet) {
  const TracedScene scene = this->scene(kNoon + kGround + board() + sheet(1.0));
  int lit = 0;
  for (double x = -2.75; x < 3.0; x += 0.5) {
    for (double z = -2.75; z < 3.0; z += 0.5) {
      const Vec3d d(0.0, -1.0, 0.0);
      const RayResult sheet_seen = scene.trace({{x, 5.0, z}, d});
      const double share = lit_ground(scene, x, z);
      EXPECT_TRUE(share < 1e-9 || std::abs(share - 1.0) < 1e-9) << share;
      lit += share > 0.5;
      // Where the sheet has a hole the lit ground shows, which is brighter.
      EXPECT_EQ(sheet_seen.radiance.x > 0.9, share > 0.5) << x << " " << z;
    }
  }
  EXPECT_EQ(lit, 72) << "half of 144";
}

TEST_P(HoleShadows, what_is_opaque_blocks_the_light_of_the_holes_too) {
  const TracedScene scene = this->scene(kNoon + kGround + even(0.5) + sheet(1.0) +
                                        "[object.ball]\ntype = \"sphere\"\ncenter = [0, 5, 0]\n");
  EXPECT_EQ(lit_ground(scene, 0.0, 0.0), 0.0);
  EXPECT_NEAR(lit_ground(scene, 2.0, 0.0), 0.5, 1e-12);
}

TEST_P(HoleShadows, of_a_lamp_end_at_the_lamp) {
  const std::string lamp =
      "[light.lamp]\ntype = \"point\"\nposition = [0, 2, 0]\nintensity = [12, 12, 12]\n";  // 3 W/m2 below
  EXPECT_NEAR(lit_ground(scene(lamp + kGround + even(0.5) + sheet(1.0)), 0.0, 0.0), 0.5, 1e-12);
  EXPECT_NEAR(lit_ground(scene(lamp + kGround + even(0.5) + sheet(3.0)), 0.0, 0.0), 1.0, 1e-12);
}

const std::string kBox =
    "[volume.box]\ntype = \"box\"\nmin = [-2, -1, -1]\nmax = [2, 1, 1]\nextinction = 0.4\n";

/// In-scattered light of the box along the x axis, as far as stretches of it are lit.
double lit_box(const std::vector<Segment>& lit) {
  double sum = 0.0;
  for (const Segment& part : lit) sum += std::exp(-0.4 * part.t0) - std::exp(-0.4 * part.t1);
  return 3.0 * std::exp(-0.4) / (4.0 * std::numbers::pi) * sum;
}

const Ray kAlong{{-2.0 - 1.0, 0.0, 0.5}, {1.0, 0.0, 0.0}};

TEST_P(HoleShadows, a_medium_gets_the_light_that_a_sheet_lets_through) {
  for (const double opacity : {0.0, 0.25, 0.7}) {
    const double tolerance = std::string(GetParam()) == "\"march\"" ? 1e-4 : 0.0;
    const RayResult seen = scene(kNoon + even(opacity) + sheet(2.0) + kBox, tolerance).trace(kAlong);
    EXPECT_NEAR(seen.radiance.x, (1.0 - opacity) * lit_box({{0.0, 4.0}}), 1e-6 + tolerance);
  }
}

TEST_P(HoleShadows, beams_through_a_board_are_those_known_on_paper) {
  const TracedScene clear = this->scene(kNoon + kBox, 1e-4);
  const TracedScene scene = this->scene(kNoon + board() + sheet(2.0) + kBox, 1e-4);
  const TracedScene ground = this->scene(kNoon + board() + sheet(2.0) + kGround);
  const bool first_is_lit = lit_ground(ground, -1.5, 0.5) > 0.5;
  const std::vector<Segment> odd{{0.0, 1.0}, {2.0, 3.0}}, even{{1.0, 2.0}, {3.0, 4.0}};
  EXPECT_NEAR(clear.trace(kAlong).radiance.x, lit_box({{0.0, 4.0}}), 2e-4);
  EXPECT_NEAR(scene.trace(kAlong).radiance.x, lit_box(first_is_lit ? odd : even), 4e-4);
}

TEST(ShadowsOfHoles, march_keeps_its_tolerance_below_a_leaf) {
  const std::string text = "[camera]\ntype = \"perspective\"\nposition = [0, 1, 7]\nfov_deg = 50\n" + kNoon +
                           kGround + board(0.4) +
                           "[object.leaf]\ntype = \"sphere\"\ncenter = [-1, 2.5, 0]\nradius = 0.6\n"
                           "shader = { type = \"phong\", opacity_texture = \"veil\" }\n" +
                           kBox;
  const PictureScene exact("\"exact\"", text, 2e-4, {16, 12}), march("\"march\"", text, 2e-3, {16, 12});
  const auto expected = exact.picture(), got = march.picture(16);
  double worst = 0.0;
  for (size_t i = 0; i < expected.size(); ++i)
    worst = std::max(worst, std::abs(expected[i].radiance.x - got[i].radiance.x));
  EXPECT_LT(worst, 2.2e-3);
}

/// Where the light of a board's squares begins and ends on a ray below it, to the length that was asked for.
TEST(ShadowsOfHoles, edges_of_squares_are_found) {
  const TracedScene scene(kNoon + board() + sheet(1.0));
  const World& world = scene.world();
  for (const double finest : {1e-2, 1e-6, 1e-12}) {
    std::vector<double> edges;
    uint64_t lookups = 0;
    const Ray ray{{-3.3, 0.5, 0.4}, {1.0, 0.0, 0.0}};
    EXPECT_EQ(append_hole_edges(*world.shapes[0], ray, {0.0, 8.0}, *world.lights[0], finest, edges, lookups),
              8u);
    ASSERT_EQ(edges.size(), 8u);
    for (size_t i = 0; i < edges.size(); ++i) EXPECT_NEAR(edges[i], double(i) + 0.3, finest);
    EXPECT_LE(lookups, 65.0 + 8.0 * std::ceil(std::log2(8.0 / 64.0 / finest)));
  }
}

TEST(ShadowsOfHoles, have_no_edges_where_they_are_even_or_out_of_reach) {
  for (const std::string& text : {kNoon + even(0.5) + sheet(1.0), kNoon + board() + sheet(-1.0)}) {
    const TracedScene scene(text);
    std::vector<double> edges;
    uint64_t lookups = 0;
    const Ray ray{{-3.3, 0.5, 0.4}, {1.0, 0.0, 0.0}};
    append_hole_edges(*scene.world().shapes[0], ray, {0.0, 8.0}, *scene.world().lights[0], 1e-9, edges,
                      lookups);
    EXPECT_TRUE(edges.empty());
  }
  const TracedScene leaf(kNoon + board(0.1) +
                         "[object.leaf]\ntype = \"sphere\"\ncenter = [0, 3, 0]\nradius = 0.5\n"
                         "shader = { type = \"phong\", opacity_texture = \"veil\" }\n");
  std::vector<double> edges;
  uint64_t lookups = 0;
  const Ray beside{{-3.0, 0.5, 2.0}, {1.0, 0.0, 0.0}};
  append_hole_edges(*leaf.world().shapes[0], beside, {0.0, 8.0}, *leaf.world().lights[0], 1e-9, edges,
                    lookups);
  EXPECT_TRUE(edges.empty());
  EXPECT_EQ(lookups, 0u) << "nothing is looked for where the leaf shades nothing";
}

/// Halves that close in on an edge take a look each; panels that do would take fourteen.
TEST(ShadowsOfHoles, exact_looks_for_edges_instead_of_integrating_over_them) {
  const TracedScene scene(kNoon + board(0.25) + sheet(2.0) + kBox, 2e-4);
  const RayResult seen = scene.trace(kAlong);
  EXPECT_NEAR(seen.radiance.x, 0.5 * lit_box({{0.0, 4.0}}), 0.01);
  EXPECT_LT(seen.error, 2.2e-4);
  EXPECT_LT(seen.samples, 1200u);
}

TEST(ShadowsOfHoles, rays_that_no_leaf_shades_are_marched) {
  const std::string leaf =
      "[object.leaf]\ntype = \"sphere\"\ncenter = [-1, 2.5, 0]\nradius = 0.3\n"
      "shader = { type = \"phong\", opacity_texture = \"veil\" }\n";
  const TracedScene scene("[render]\nintegrator = \"march\"\n" + kNoon + board(0.1) + leaf + kBox, 2e-3);
  std::vector<Ray> rays;
  for (const double z : {0.0, 0.6, 0.7, -0.6}) rays.push_back({{-4.0, 0.0, z}, {1.0, 0.0, 0.0}});
  std::vector<RayResult> results(rays.size());
  Counters counters;
  const EffectPlan plan = plan_effects(scene.scene());
  scene.scene().render.integrator->prepare(scene.world(), plan, {2e-3})->trace(rays, results, counters);
  EXPECT_EQ(counters["exact_rays"], 1u) << "the one below the leaf";
}

TEST(ShadowsOfHoles, cost_nothing_where_there_are_none) {
  const std::string opaque = "[texture.veil]\ntype = \"checker\"\n";
  const TracedScene scene(kNoon + kGround + opaque + sheet(1.0));
  Counters counters;
  const EffectPlan plan = plan_effects(scene.scene());
  const auto tracer = scene.scene().render.integrator->prepare(scene.world(), plan, {0.0});
  const Ray ray{{0.2, 0.5, 0.0}, normalize(Vec3d(-0.2, -0.5, 0.0))};
  RayResult result;
  tracer->trace({&ray, 1}, {&result, 1}, counters);
  EXPECT_EQ(result.radiance.x, 0.0);
  EXPECT_EQ(counters["surface_shadow_rays"], 1u);
  EXPECT_EQ(counters["texture_lookups"], 0u) << "the ground has none, and the sheet is opaque";
}

}  // namespace
}  // namespace pileus
