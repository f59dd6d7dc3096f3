// Meshes and instances in scenes: where they stand, what they take, what is refused.
#include <cmath>
#include <fstream>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/math/offset_point.h"
#include "lib/scene/world.h"
#include "tests/fixtures/meshes.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
const Segment kEverywhere{0.0, kInf};

class Instances : public testing::Test {
 protected:
  TempFolder m_folder;
  std::mt19937 m_random{4};

  double uniform(double a = -1.0, double b = 1.0) {
    return std::uniform_real_distribution<double>(a, b)(m_random);
  }
  Vec3d vector() { return {uniform(), uniform(), uniform()}; }

  void write_obj(const std::string& name, const MeshData& mesh) {
    std::ofstream file(m_folder / name);
    file.precision(9);
    for (const Vec3f& p : mesh.vertices) file << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
    for (const auto& t : mesh.triangles)
      file << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  }

  World world(const std::string& text) {
    return build_world(
        parse_scene("pileus = 1\n[camera]\ntype = \"perspective\"\n" + text, "test", m_folder.path()));
  }
  std::string complaint(const std::string& text) {
    try {
      world(text);
    } catch (const Error& error) {
      return error.diagnostics()[0].message;
    }
    return "";
  }
};

TEST_F(Instances, stand_where_they_are_put) {
  const World scene = world(
      "[object.ball]\ntype = \"sphere\"\nradius = 0.5\nhidden = true\n"
      "[object.some]\ntype = \"instance\"\nof = \"ball\"\ntranslate = [0, 10, 0]\n"
      "placements = [{ translate = [5, 0, 0] }, { translate = [-5, 0, 0], scale = [2, 1, 1] }]\n");
  ASSERT_EQ(scene.shapes.size(), 1u) << "the hidden one is not there";
  EXPECT_FALSE(nearest_surface(scene, {{0, 0, 5}, {0, 0, -1}}, kEverywhere));
  const auto right = nearest_surface(scene, {{5, 10, 5}, {0, 0, -1}}, kEverywhere);
  ASSERT_TRUE(right);
  EXPECT_DOUBLE_EQ(right->t, 4.5);
  EXPECT_EQ(right->n, Vec3d(0, 0, 1));
  const auto left = nearest_surface(scene, {{-20, 10, 0}, {1, 0, 0}}, kEverywhere);
  ASSERT_TRUE(left);
  EXPECT_DOUBLE_EQ(left->t, 14.0) << "twice as wide";
  EXPECT_EQ(left->n, Vec3d(-1, 0, 0));
  EXPECT_TRUE(is_occluded(scene, {{-5, 0, 0}, {0, 1, 0}}, kEverywhere));
  EXPECT_FALSE(is_occluded(scene, {{-5, 0, 0}, {0, 1, 0}}, {0.0, 9.0}));
}

TEST_F(Instances, look_like_their_object_unless_told_otherwise) {
  const World scene = world(
      "[object.a_ball]\ntype = \"sphere\"\n[object.b_same]\ntype = \"instance\"\nof = \"a_ball\"\n"
      "[object.c_other]\ntype = \"instance\"\nof = \"a_ball\"\nshader = { type = \"phong\" }\n");
  ASSERT_EQ(scene.shapes.size(), 3u);
  EXPECT_EQ(scene.shapes[1]->shader, scene.shapes[0]->shader);
  EXPECT_TRUE(scene.shapes[2]->shader);
  EXPECT_NE(scene.shapes[2]->shader, scene.shapes[0]->shader);
}

TEST_F(Instances, may_be_of_instances_but_not_of_themselves) {
  const World scene = world(
      "[object.ball]\ntype = \"sphere\"\nhidden = true\n"
      "[object.row]\ntype = \"instance\"\nof = \"ball\"\nhidden = true\n"
      "placements = [{ translate = [0, 0, 0] }, { translate = [4, 0, 0] }]\n"
      "[object.field]\ntype = \"instance\"\nof = \"row\"\nrotate_deg = [0, 90, 0]\n"
      "placements = [{ translate = [0, 0, 0] }, { translate = [0, 0, 4] }]\n");
  ASSERT_EQ(scene.shapes.size(), 1u);
  for (const Vec3d& place : {Vec3d(0, 0, 0), Vec3d(0, 0, -4), Vec3d(4, 0, 0), Vec3d(4, 0, -4)}) {
    EXPECT_NEAR(nearest_surface(scene, {place + Vec3d(0, 9, 0), {0, -1, 0}}, kEverywhere)->t, 8.0, 1e-12);
  }
  EXPECT_EQ(
      complaint("[object.a]\ntype = \"instance\"\nof = \"b\"\n[object.b]\ntype = \"instance\"\nof = \"a\"\n"),
      "object \"a\": is made of itself: a -> b -> a; expected objects that do not lead back");
  std::string chain = "[object.o0]\ntype = \"sphere\"\n";
  for (int n = 1; n < 50; ++n) {
    chain += fmt::format("[object.o{}]\ntype = \"instance\"\nof = \"o{}\"\n", n, n - 1);
  }
  EXPECT_NE(complaint(chain + "[object.a]\ntype = \"instance\"\nof = \"o49\"\n").find("more than 32 times"),
            std::string::npos);
}

TEST_F(Instances, of_what_makes_no_sense_are_refused) {
  EXPECT_EQ(
      complaint("[object.a]\ntype = \"instance\"\nof = \"ground\"\n[object.ground]\ntype = \"plane\"\n"),
      "object \"a\": object \"ground\" has no end; expected one that has");
  EXPECT_EQ(complaint("[object.a]\ntype = \"instance\"\nof = \"bal\"\n[object.ball]\ntype = \"sphere\"\n"),
            "object \"a\": there is no object \"bal\"; the scene has a or ball; nearest: ball");
  EXPECT_NE(complaint("[object.a]\ntype = \"instance\"\nof = \"ball\"\nfile = \"none.csv\"\n"
                      "[object.ball]\ntype = \"sphere\"\n")
                .find("cannot be read"),
            std::string::npos);
  EXPECT_NE(complaint("[object.a]\ntype = \"instance\"\n").find("parameter \"of\" is missing"),
            std::string::npos);
}

/// Rays from inside a rough ball towards its edges and corners, placed far away, turned, stretched.
TEST_F(Instances, have_no_cracks_wherever_they_stand) {
  const MeshData ball = ball_mesh(3, 1.0f, Vec3f(0.0f), 0.2);
  write_obj("ball.obj", ball);
  const std::string placement =
      "rotate_deg = [20, 130, -50]\nscale = [1, 3, 0.4]\ntranslate = [150000, -150000, 150000]\n";
  const World scene = world("[object.ball]\ntype = \"mesh\"\nfile = \"ball.obj\"\n" + placement);
  Placement same;
  same.rotate_deg = {20, 130, -50}, same.scale = {1, 3, 0.4}, same.translate = {150000, -150000, 150000};
  const Affine to_world = same.world_from_object();
  size_t lost = 0;
  double largest_error = 0.0;
  for (int n = 0; n < 120000; ++n) {
    const auto& corners = ball.triangles[size_t(uniform(0.0, double(ball.triangles.size()) * 0.9999))];
    const Vec3d a(ball.vertices[corners[0]]), b(ball.vertices[corners[1]]);
    const double share = uniform(-1.0, 2.0);
    const Vec3d target = to_world.point(share < 0.0 ? a : share > 1.0 ? b : a + share * (b - a));
    const Vec3d o = to_world.point(0.4 * vector());
    const auto hit = nearest_surface(scene, {o, normalize(target - o)}, kEverywhere);
    lost += !hit;
    if (hit) largest_error = std::max(largest_error, hit->error);
  }
  EXPECT_EQ(lost, 0u);
  EXPECT_LT(largest_error, 1e-7);
}

/// The true distance of the hit from the surface, in extended precision, against what the hit claims.
TEST_F(Instances, tell_how_far_hits_are_off) {
  write_obj("one.obj", MeshData{{{0, 0, 0}, {1, 0, 0.25}, {0, 1, 0.5}}, {}, {{0, 1, 2}}});
  using Vec3l = Imath::Vec3<long double>;
  for (int n = 0; n < 100; ++n) {
    const Vec3d translate = std::exp2(uniform(0.0, 20.0)) * vector();
    const Vec3d scale(std::exp2(uniform(-6.0, 6.0)), std::exp2(uniform(-6.0, 6.0)),
                      std::exp2(uniform(-6.0, 6.0)));
    const World scene = world(fmt::format(
        "[object.one]\ntype = \"mesh\"\nfile = \"one.obj\"\nscale = [{}, {}, {}]\ntranslate = [{}, {}, {}]\n",
        scale.x, scale.y, scale.z, translate.x, translate.y, translate.z));
    const auto exact = [&](double x, double y, double z) {
      return Vec3l(x, y, z) * Vec3l(scale) + Vec3l(translate);
    };
    const Vec3l a = exact(0, 0, 0), n_exact = (exact(1, 0, 0.25) - a).cross(exact(0, 1, 0.5) - a);
    for (int k = 0; k < 100; ++k) {
      const Vec3d target(exact(uniform(0, 0.5), uniform(0, 0.5), 0.2)), d = normalize(vector());
      const Ray ray{target - std::exp2(uniform(-3.0, 10.0)) * d, d};
      const auto hit = nearest_surface(scene, ray, kEverywhere);
      if (!hit) continue;
      const long double off =
          std::fabs((Vec3l(ray.at(hit->t)) - a).dot(n_exact)) / std::sqrt(n_exact.dot(n_exact));
      ASSERT_LE(double(off), hit->error);
    }
  }
}

TEST_F(Instances, ten_thousand_are_found_as_one_by_one) {
  std::ofstream table(m_folder / "places.csv");
  std::vector<Vec3d> places;
  for (int n = 0; n < 10000; ++n) {
    places.push_back(100.0 * vector());
    table << fmt::format("{},{},{},{},{}\n", places.back().x, places.back().y, places.back().z, 0.5, n);
  }
  table.close();
  const World scene = world(
      "[object.ball]\ntype = \"sphere\"\nradius = 2\nhidden = true\n"
      "[object.many]\ntype = \"instance\"\nof = \"ball\"\nfile = \"places.csv\"\n");
  size_t hits = 0;
  for (int n = 0; n < 300; ++n) {
    const Vec3d o = 120.0 * vector();
    const Ray ray{o, normalize(50.0 * vector() - o)};
    double nearest = kInf;
    for (const Vec3d& place : places) {
      const Vec3d f = ray.o - place;
      const double b = dot(f, ray.d), discriminant = b * b - f.length2() + 1.0;
      if (discriminant < 0.0) continue;
      for (const double t : {-b - std::sqrt(discriminant), -b + std::sqrt(discriminant)}) {
        if (t > 0.0) nearest = std::min(nearest, t);
      }
    }
    const auto hit = nearest_surface(scene, ray, kEverywhere);
    ASSERT_EQ(hit.has_value(), nearest < kInf);
    if (hit) {
      ASSERT_NEAR(hit->t, nearest, 1e-6);
      ++hits;
    }
  }
  EXPECT_GT(hits, 50u);
}

TEST_F(Instances, smooth_meshes_shade_round_and_start_rays_off_their_faces) {
  write_obj("ball.obj", ball_mesh(2, 1.0f, Vec3f(0.0f), 0.0));
  const World scene = world("[object.ball]\ntype = \"mesh\"\nfile = \"ball.obj\"\nsmooth = true\n");
  size_t hits = 0;
  for (int n = 0; n < 20000; ++n) {
    const Vec3d o = 3.0 * normalize(vector());
    const Ray ray{o, normalize(vector() - o)};
    const auto hit = nearest_surface(scene, ray, kEverywhere);
    if (!hit) continue;
    const Vec3d p = ray.at(hit->t);
    ++hits;
    ASSERT_LT(dot(hit->n, ray.d), 0.0);
    const Vec3d start = offset_point(p, hit->n, hit->error);
    ASSERT_FALSE(is_occluded(scene, {start, normalize(p)}, kEverywhere)) << "straight out";
  }
  EXPECT_GT(hits, 5000u);
}

}  // namespace
}  // namespace pileus
