// Meshes: no ray slips through, hits lie where they say.
#include "lib/geom/triangle_mesh.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/math/offset_point.h"
#include "tests/fixtures/meshes.h"

namespace pileus {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
const Segment kEverywhere{0.0, kInf};

class MeshRays : public testing::Test {
 protected:
  std::mt19937 m_random{9};

  double uniform(double a = -1.0, double b = 1.0) {
    return std::uniform_real_distribution<double>(a, b)(m_random);
  }
  Vec3d vector() { return {uniform(), uniform(), uniform()}; }
  Vec3d direction() {
    for (;;) {
      const Vec3d v = vector();
      if (v.length2() <= 1.0 && v.length2() > 1e-4) return normalize(v);
    }
  }
  uint32_t pick(size_t count) {
    return std::uniform_int_distribution<uint32_t>(0, uint32_t(count - 1))(m_random);
  }

  /// A corner of a triangle, or a point of one of its edges.
  Vec3d on_edge(const MeshData& mesh) {
    const auto& corners = mesh.triangles[pick(mesh.triangles.size())];
    const uint32_t k = pick(3);
    const Vec3d a(mesh.vertices[corners[k]]), b(mesh.vertices[corners[(k + 1) % 3]]);
    const double share = uniform(-1.0, 2.0);
    return share <= 0.0 ? a : share >= 1.0 ? b : a + share * (b - a);
  }
};

TEST_F(MeshRays, never_leave_a_closed_mesh_unseen) {
  size_t lost = 0;
  for (const Vec3f& place : {Vec3f(0.0f), Vec3f(150000.0f, -150000.0f, 150000.0f)}) {
    for (const float size : {1.0f, 300.0f}) {
      const MeshData ball = ball_mesh(3, size, place, 0.2);
      const TriangleMesh mesh(ball);
      for (int n = 0; n < 60000; ++n) {
        const Vec3d o = Vec3d(place) + 0.5 * size * vector(), target = on_edge(ball);
        lost += !mesh.intersect({o, normalize(target - o)}, kEverywhere);
      }
    }
  }
  EXPECT_EQ(lost, 0u);
}

TEST_F(MeshRays, find_no_crack_along_axes) {
  // A cube of a lattice: rays along axes run through its corners and edges exactly.
  const MeshData cube = cube_mesh(8);
  const TriangleMesh mesh(cube);
  for (int x = 0; x <= 8; ++x) {
    for (int y = 0; y <= 8; ++y) {
      for (int axis = 0; axis < 3; ++axis) {
        Vec3d o(0.5), d(0.0);
        o[(axis + 1) % 3] = x / 8.0, o[(axis + 2) % 3] = y / 8.0;
        d[axis] = 1.0;
        const auto hit = mesh.intersect({o, d}, kEverywhere);
        ASSERT_TRUE(hit) << o << d;
        EXPECT_EQ(hit->t, 0.5);
        d[axis] = -1.0, d[(axis + 1) % 3] = -0.0;
        ASSERT_TRUE(mesh.intersect({o, d}, kEverywhere));
      }
    }
  }
}

TEST_F(MeshRays, agree_with_asking_every_triangle) {
  const MeshData ball = ball_mesh(2, 2.0f, Vec3f(10.0f, 0.0f, 0.0f), 0.2);
  const TriangleMesh mesh(ball);
  std::vector<TriangleMesh> alone;
  for (const auto& corners : ball.triangles) alone.emplace_back(MeshData{ball.vertices, {}, {corners}});
  size_t hits = 0;
  for (int n = 0; n < 2000; ++n) {
    const Vec3d o = Vec3d(10.0, 0.0, 0.0) + 5.0 * vector();
    const Ray ray{o, normalize(on_edge(ball) + 0.3 * vector() - o)};
    double nearest = kInf;
    for (const TriangleMesh& one : alone) {
      if (const auto hit = one.intersect(ray, {0.0, nearest})) nearest = hit->t;
    }
    const auto hit = mesh.intersect(ray, kEverywhere);
    ASSERT_EQ(hit ? hit->t : kInf, nearest);
    hits += hit.has_value();
  }
  EXPECT_GT(hits, 500u);
}

TEST_F(MeshRays, errors_bound_the_distance_from_the_triangle) {
  size_t grazing = 0;
  for (int n = 0; n < 100000; ++n) {
    // Triangles of all sizes and places, some hair-thin, met at all angles.
    const Vec3d place = std::exp2(uniform(-5.0, 18.0)) * direction();
    const double size = std::exp2(uniform(-10.0, 10.0));
    MeshData one{{}, {}, {{0, 1, 2}}};
    for (int k = 0; k < 3; ++k) one.vertices.emplace_back(place + size * vector());
    if (n % 4 == 0) one.vertices[2] = Vec3f(Vec3d(one.vertices[1]) + 1e-3 * size * vector());
    const Vec3d a(one.vertices[0]), b(one.vertices[1]), c(one.vertices[2]);
    const Vec3d target = a + uniform(0, 0.5) * (b - a) + uniform(0, 0.5) * (c - a);
    const Vec3d in_plane = normalize(target - a + 1e-9 * vector());
    const Vec3d d = n % 2 ? direction() : normalize(in_plane + std::exp2(uniform(-30.0, 0.0)) * direction());
    const Ray ray{target - std::exp2(uniform(-3.0, 12.0)) * d, d};
    const auto hit = TriangleMesh(one).intersect(ray, kEverywhere);
    if (!hit) continue;
    const Vec3d p = ray.at(hit->t);
    ASSERT_LE(distance_from_triangle(p, a, b, c), hit->error) << n << " " << a << b << c << ray.o << ray.d;
    grazing += std::fabs(dot(hit->face_normal, d)) < 1e-3;
  }
  EXPECT_GT(grazing, 1000u);
}

TEST_F(MeshRays, leave_convex_meshes_without_meeting_them_again) {
  size_t hits = 0;
  for (const float place : {0.0f, 150000.0f}) {
    const MeshData cube = cube_mesh(4, Vec3f(place, 0.0f, -place));
    const TriangleMesh mesh(cube);
    for (int n = 0; n < 30000; ++n) {
      const Vec3d center = Vec3d(place + 0.5, 0.5, -place + 0.5), o = center + 3.0 * direction();
      const Ray ray{o, normalize(center + 0.5 * vector() - o)};
      const auto hit = mesh.intersect(ray, kEverywhere);
      if (!hit) continue;
      Vec3d wi =
          normalize(cross(hit->face_normal, direction()) + std::exp2(uniform(-30.0, 1.0)) * hit->face_normal);
      if (dot(wi, hit->face_normal) < 1e-12) continue;
      ++hits;
      ASSERT_FALSE(
          mesh.intersect({offset_point(ray.at(hit->t), hit->face_normal, hit->error), wi}, kEverywhere));
    }
  }
  EXPECT_GT(hits, 20000u);
}

TEST_F(MeshRays, get_sound_answers_however_hostile_they_are) {
  const double values[] = {0.0, -0.0, 1.0, -1.0, 1e-320, 1e200, -1e308, kInf, -kInf, std::nan("")};
  const TriangleMesh mesh(cube_mesh(2));
  for (const double a : values) {
    for (const double b : values) {
      for (const Ray& ray :
           {Ray{{a, b, 1}, {0, 0, -1}}, Ray{{0, 0, 3}, {a, b, -1}}, Ray{{a, 0, 0}, {b, -1, a}}}) {
        for (const Segment segment : {kEverywhere, Segment{-5.0, 5.0}, Segment{std::nan(""), 1.0}}) {
          const auto hit = mesh.intersect(ray, segment);
          if (!hit) continue;
          ASSERT_TRUE(std::isfinite(hit->t) && hit->t > segment.t0 && hit->t < segment.t1);
        }
      }
    }
  }
}

TEST(TriangleMesh, keeps_to_the_segment) {
  const TriangleMesh cube(cube_mesh(1));
  const Ray ray{{0.3, 0.4, 3.0}, {0, 0, -1}};
  EXPECT_DOUBLE_EQ(cube.intersect(ray, kEverywhere)->t, 2.0);
  EXPECT_DOUBLE_EQ(cube.intersect(ray, {2.5, kInf})->t, 3.0);
  EXPECT_EQ(cube.intersect(ray, {0.0, 2.5})->face_normal, Vec3d(0, 0, 1));
  EXPECT_FALSE(cube.intersect(ray, {0.0, 1.5}));
  EXPECT_FALSE(cube.intersect(ray, {2.5, 2.5}));
  EXPECT_FALSE(cube.intersect(ray, {3.5, kInf}));
}

TEST(TriangleMesh, triangles_without_area_are_met_by_no_ray) {
  const TriangleMesh mesh(MeshData{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {}, {{0, 1, 2}, {1, 1, 1}}});
  EXPECT_FALSE(mesh.intersect({{0.5, 0, 5}, {0, 0, -1}}, kEverywhere));
}

TEST(TriangleMesh, smooth_normals_are_those_of_the_ball) {
  MeshData ball = ball_mesh(4, 1.0f, Vec3f(0.0f), 0.0);
  make_smooth_normals(ball);
  const TriangleMesh mesh(std::move(ball));
  for (const Vec3d& d : {Vec3d(1, 0, 0), normalize(Vec3d(0.3, -0.5, 0.7)), normalize(Vec3d(-1, 2, 0.1))}) {
    const auto hit = mesh.intersect({5.0 * d, -d}, kEverywhere);
    ASSERT_TRUE(hit);
    EXPECT_GT(dot(hit->smooth_normal, d), 1.0 - 1e-4);
    EXPECT_LT(length(hit->smooth_normal - hit->face_normal), 0.1);
  }
}

TEST(TriangleMesh, joins_vertices_at_one_place_and_no_others) {
  const float next = std::nextafter(1.0f, 2.0f);
  MeshData mesh{
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 1, 0}, {next, 1, 0}}, {}, {{0, 1, 2}, {3, 5, 4}}};
  join_equal_vertices(mesh);
  EXPECT_EQ(mesh.vertices.size(), 4u);
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.vertices[mesh.triangles[1][1]].x, next);
  EXPECT_EQ(mesh.triangles[1][0], mesh.triangles[0][1]);
  EXPECT_EQ(mesh.triangles[1][2], mesh.triangles[0][2]);
}

}  // namespace
}  // namespace pileus
