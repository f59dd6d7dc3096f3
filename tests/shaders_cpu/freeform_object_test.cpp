// The object "freeform": what rays see of a free form.
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/math/offset_point.h"
#include "lib/scene/scene.h"
#include "lib/scene/world.h"

namespace pileus {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

World world_of(const std::string& form, const std::string& object = "") {
  const std::string text =
      "pileus = 1\n[camera]\ntype = \"perspective\"\nposition = [0, 0, 9]\n[freeform.blob]\n" + form +
      "\n[freeform.endless]\nbase = { cylinder = {} }\n[object.blob]\ntype = \"freeform\"\nform = "
      "\"blob\"\n" +
      object;
  return build_world(parse_scene(text, "s.toml", "."));
}

const char* const kBumped =
    "base = { ellipsoid = { radii = [2, 1, 1] } }\n"
    "perturb = [ { sphere = { center = [1.5, 0.5, 0], radius = 0.8 }, factor = 0.9 },\n"
    "            { sphere = { center = [-1, 0.8, 0.2], radius = 0.7 }, factor = -0.9 } ]";

TEST(FreeFormObject, is_hit_as_its_ellipsoid_is) {
  const World world = world_of("base = { ellipsoid = { radii = [2, 1, 0.5] } }");
  const auto from_outside = nearest_surface(world, {{0, 0, 9}, {0, 0, -1}}, {0, kInf});
  ASSERT_TRUE(from_outside);
  EXPECT_NEAR(from_outside->t, 8.5, 1e-14);
  EXPECT_EQ(from_outside->n, Vec3d(0, 0, 1));
  const auto from_inside = nearest_surface(world, {{0, 0, 0}, {0, 1, 0}}, {0, kInf});
  ASSERT_TRUE(from_inside);
  EXPECT_NEAR(from_inside->t, 1.0, 1e-15);
  EXPECT_EQ(from_inside->n, Vec3d(0, -1, 0)) << "on the side the ray comes from";
  EXPECT_FALSE(nearest_surface(world, {{0, 2, 9}, {0, 0, -1}}, {0, kInf}));
  EXPECT_FALSE(nearest_surface(world, {{0, 0, 9}, {0, 0, -1}}, {0, 8.4}));
  EXPECT_FALSE(nearest_surface(world, {{0, 0, 9}, {0, 0, -1}}, {9.6, kInf}));
}

/// A ray that leaves from a hit, off by what the hit says of its own error, meets nothing at once.
TEST(FreeFormObject, does_not_shade_itself_where_light_leaves_it) {
  const World world = world_of(kBumped);
  int hits = 0;
  for (int i = -20; i <= 20; ++i) {
    for (int j = -12; j <= 12; ++j) {
      const Vec3d eye(0.3, 4, 1e4);
      const Vec3d towards = normalize(Vec3d(0.11 * i, 0.1 * j, 0) - eye);
      const auto hit = nearest_surface(world, {eye, towards}, {0, kInf});
      if (!hit) continue;
      ++hits;
      EXPECT_LT(hit->error, 1e-9);
      EXPECT_LE(dot(hit->n, towards), 0.0);
      const Vec3d start = offset_point(eye + hit->t * towards, hit->n, hit->error);
      EXPECT_FALSE(is_occluded(world, {start, hit->n}, {0, 1e-3})) << i << " " << j;
    }
  }
  EXPECT_GT(hits, 400);
}

TEST(FreeFormObject, tells_where_its_shadow_begins_and_ends) {
  const World world = world_of("base = { ellipsoid = { radii = [1, 1, 1] } }",
                               "[light.sun]\ntype = \"sun\"\n"
                               "direction = [0, 1, 0]\n");
  std::vector<double> edges;
  world.shapes[0]->append_shadow_edges({{-5, -3, 0}, {1, 0, 0}}, *world.lights[0], edges);
  ASSERT_EQ(edges.size(), 2u);
  EXPECT_NEAR(edges[0], 4.0, 1e-7);
  EXPECT_NEAR(edges[1], 6.0, 1e-7);
}

/// What it may shade of a ray is told for each part of it, and holds all that it shades.
TEST(FreeFormObject, shades_nothing_but_what_it_may) {
  const World world = world_of(
      "union = [\"left\", \"right\"]\n"
      "[freeform.left]\nbase = { ellipsoid = { center = [-3, 0, 0], radii = [1, 0.4, 2] } }\n"
      "[freeform.right]\nbase = { ellipsoid = { center = [3, 1, 0], radii = [0.3, 0.4, 0.5] } }");
  const Shape& shape = *world.shapes[0];
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  int shaded = 0, free = 0;
  for (int n = 0; n < 900; ++n) {
    const Vec3d sun = normalize(Vec3d(normal(random), normal(random), normal(random)));
    const Ray ray{{6.0 * normal(random), 6.0 * normal(random), 6.0 * normal(random)},
                  normalize(Vec3d(normal(random), normal(random), normal(random)))};
    std::vector<Segment> stretches;
    shape.append_shadowable(ray, {0, 20}, sun, stretches);
    EXPECT_TRUE(stretches.empty() || stretches.size() == 2);
    for (double t = 0.0; t < 20.0; t += 0.1) {
      const bool may_be = std::any_of(stretches.begin(), stretches.end(),
                                      [&](const Segment& s) { return t >= s.t0 && t <= s.t1; });
      const bool is = shape.intersect({ray.at(t), sun}, {0, kInf}).has_value();
      ASSERT_TRUE(may_be || !is) << "ray " << n << ", t " << t;
      shaded += is;
      free += !may_be;
    }
  }
  EXPECT_GT(shaded, 500);
  EXPECT_GT(free, 30000);
}

TEST(FreeFormObject, refuses_a_form_without_end) {
  try {
    world_of("base = { form = \"endless\" }");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(
        error.diagnostics().at(0).message,
        "object \"blob\": free form \"blob\" has no end; expected one that has, such as its intersection "
        "with an ellipsoid");
  }
}

}  // namespace
}  // namespace pileus
