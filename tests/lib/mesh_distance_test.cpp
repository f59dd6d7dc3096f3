// Distances from closed meshes against every triangle asked, and what is refused; meshes as bodies of clouds.
#include "lib/geom/mesh_distance.h"

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "lib/cloud/cloud_body.h"
#include "lib/core/error.h"
#include "lib/freeform/shapes.h"
#include "tests/fixtures/meshes.h"

namespace pileus {
namespace {

class MeshDistances : public testing::Test {
 protected:
  std::mt19937 m_random{3};
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(m_random); }
  Vec3d vector(double a, double b) { return {uniform(a, b), uniform(a, b), uniform(a, b)}; }

  static double by_every_triangle(const MeshData& mesh, const Vec3d& p) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& [a, b, c] : mesh.triangles) {
      nearest = std::min(nearest, distance_from_triangle(p, Vec3d(mesh.vertices[a]), Vec3d(mesh.vertices[b]),
                                                         Vec3d(mesh.vertices[c])));
    }
    return nearest;
  }
  static std::string complaint(const MeshData& mesh) {
    try {
      MeshDistance{mesh};
    } catch (const Error& error) {
      return error.diagnostics()[0].message;
    }
    return "";
  }
};

TEST_F(MeshDistances, are_those_to_the_nearest_triangle_on_the_right_side) {
  for (const double roughness : {0.0, 0.3}) {
    for (const Vec3f& place : {Vec3f(0.0f), Vec3f(3000.0f, -20.0f, 700.0f)}) {
      const MeshData mesh = ball_mesh(3, 2.0f, place, roughness);
      const MeshDistance distance(mesh);
      const TriangleMesh solid(mesh);
      for (int n = 0; n < 100; ++n) {
        const Vec3d p = Vec3d(place) + vector(-3.0, 3.0);
        const double got = distance.inside(p);
        EXPECT_NEAR(std::abs(got), by_every_triangle(mesh, p), 1e-9);
        // A ray out of a solid that is a star around its middle meets it once more than on the way back.
        const double r = length(p - Vec3d(place));
        const auto hit = solid.intersect({Vec3d(place), (p - Vec3d(place)) / r}, {0.0, 100.0});
        ASSERT_TRUE(hit);
        if (std::abs(hit->t - r) > 1e-6) {
          EXPECT_EQ(got > 0.0, r < hit->t) << n;
        }
        EXPECT_LE(got, distance.deepest());
      }
    }
  }
}

TEST_F(MeshDistances, know_the_deepest_point) {
  const MeshDistance ball(ball_mesh(5, 2.0f, Vec3f(0.0f), 0.0));
  EXPECT_LT(ball.deepest(), 2.0 * 1.01);
  EXPECT_GE(ball.deepest(), ball.inside(Vec3d(0.0)));
  // Turned inside out, as triangles that share no corners, stretched: the same solid.
  const MeshData joined = ball_mesh(3, 1.0f, Vec3f(0.0f), 0.0);
  MeshData soup;
  for (const auto& t : joined.triangles) {
    for (const size_t k : {2, 1, 0}) soup.vertices.push_back(joined.vertices[t[k]]);
    const uint32_t end = uint32_t(soup.vertices.size());
    soup.triangles.push_back({end - 3, end - 2, end - 1});
  }
  const MeshDistance inverted(soup, Affine::translation({0, 5, 0}) * Affine::scaling({2, 1, 3}));
  EXPECT_NEAR(inverted.inside({0, 5, 0}), 1.0, 0.02);
  EXPECT_NEAR(inverted.bounds().max.z, 3.0, 1e-6);
  EXPECT_LT(inverted.inside({0, 0, 0}), 0.0);
}

TEST_F(MeshDistances, of_surfaces_that_are_not_closed_are_refused) {
  MeshData open = ball_mesh(2, 1.0f, Vec3f(0.0f), 0.0);
  EXPECT_EQ(complaint(open), "");
  open.triangles.pop_back();
  EXPECT_NE(complaint(open).find("the surface is not closed: the edge from ("), std::string::npos);
  EXPECT_NE(complaint(open).find("belongs to 1 triangle;"), std::string::npos);
  MeshData turned = ball_mesh(2, 1.0f, Vec3f(0.0f), 0.0);
  std::swap(turned.triangles[5][0], turned.triangles[5][1]);
  EXPECT_NE(complaint(turned).find("turned different ways"), std::string::npos);
  EXPECT_NE(complaint(cube_mesh(2)).find("turned different ways"), std::string::npos);
  MeshData flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  flat.triangles = {{0, 1, 2}, {2, 1, 0}};
  EXPECT_NE(complaint(flat).find("encloses nothing"), std::string::npos);
}

TEST_F(MeshDistances, make_the_function_of_a_sphere_that_its_free_form_is) {
  const CloudBody form = FreeForm(sphere({1, 2, 3}, 2.0)),
                  mesh(std::make_shared<const MeshDistance>(ball_mesh(5, 2.0f, Vec3f(1, 2, 3), 0.0)));
  for (int n = 0; n < 300; ++n) {
    const Vec3d p = Vec3d(1, 2, 3) + vector(-1.4, 1.4);
    EXPECT_NEAR(mesh.value(p), form.value(p), 0.02) << "the mesh is a little smaller";
  }
}

TEST_F(MeshDistances, bound_values_in_boxes) {
  const MeshDistance distance(ball_mesh(3, 2.0f, Vec3f(50.0f, 0.0f, 0.0f), 0.3));
  const CloudBody body{std::make_shared<const MeshDistance>(distance)};
  double tightest = 1.0;
  for (int n = 0; n < 300; ++n) {
    const Vec3d middle = Vec3d(50, 0, 0) + vector(-2.5, 2.5),
                half = std::pow(10.0, uniform(-4, 0)) * vector(0, 1);
    const PointLattice points{middle - half, half / 1.5, Vec3i(4)};
    const CloudBody::Local whole = body.within({middle - 2.0 * half, middle + 2.0 * half}),
                           local = whole.within(points.box());
    std::array<float, 64> f;
    local.values(points, f);
    for (const float value : f) {
      EXPECT_GE(double(value), local.range().lo);
      EXPECT_LE(double(value), local.range().hi);
    }
    EXPECT_NEAR(double(f[0]), body.value(points.first), 1e-6);
    tightest = std::min(tightest, local.range().hi - local.range().lo);
  }
  EXPECT_LT(tightest, 1e-3);
}

}  // namespace
}  // namespace pileus
