#include "lib/scene/shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/math/offset_point.h"
#include "lib/math/unit_vector.h"
#include "tests/shaders_cpu/make_plugin.h"

namespace pileus {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
const double kNaN = std::nan("");
const Segment kEverywhere{0.0, kInf};

std::shared_ptr<Shape> sphere(const Vec3d& center, double radius) {
  return make_plugin<Shape>("sphere", {{"center", center}, {"radius", radius}});
}
std::shared_ptr<Shape> plane(const Vec3d& point, const Vec3d& normal) {
  return make_plugin<Shape>("plane", {{"point", point}, {"normal", normal}});
}

TEST(Shape, has_a_phong_shader_by_default) {
  for (const char* name : {"sphere", "plane"}) {
    const auto shape = make_plugin<Shape>(name);
    ParamTable table;
    shape->describe(table);
    const auto& params = table.params();
    const auto shader =
        std::find_if(params.begin(), params.end(), [](const Param& param) { return param.name == "shader"; });
    ASSERT_NE(shader, params.end());
    EXPECT_EQ(std::get<PluginSlot>(shader->target).kind, "surface");
    EXPECT_EQ(std::get<PluginSlot>(shader->target).default_name, "phong");
  }
}

TEST(Sphere, is_hit_from_outside_and_from_inside) {
  const auto ball = sphere({0, 0, 0}, 2.0);
  const auto outside = ball->intersect({{0, 0, 5}, {0, 0, -1}}, kEverywhere);
  ASSERT_TRUE(outside);
  EXPECT_EQ(outside->t, 3.0);
  EXPECT_EQ(outside->n, Vec3d(0, 0, 1));
  const auto inside = ball->intersect({{0, 0, 1}, {0, 0, -1}}, kEverywhere);
  ASSERT_TRUE(inside);
  EXPECT_EQ(inside->t, 3.0);
  EXPECT_EQ(inside->n, Vec3d(0, 0, 1)) << "on the side the ray comes from";
}

TEST(Sphere, keeps_to_the_segment) {
  const auto ball = sphere({0, 0, 0}, 1.0);
  const Ray ray{{0, 0, 5}, {0, 0, -1}};
  EXPECT_FALSE(ball->intersect(ray, {0.0, 4.0}));
  EXPECT_EQ(ball->intersect(ray, {4.0, 10.0})->t, 6.0);
  EXPECT_FALSE(ball->intersect(ray, {6.0, kInf}));
  EXPECT_FALSE(ball->intersect(ray, {3.0, 3.0}));
  EXPECT_FALSE(ball->intersect({{0, 0, 5}, {0, 0, 1}}, kEverywhere));
}

TEST(Sphere, bounds_hold_it) {
  const Box3d box = sphere({1, 2, 3}, 0.5)->bounds();
  EXPECT_EQ(box.min, Vec3d(0.5, 1.5, 2.5));
  EXPECT_EQ(box.max, Vec3d(1.5, 2.5, 3.5));
}

TEST(Sphere, tangents_touch_or_miss) {
  const auto ball = sphere({0, 0, 0}, 1.0);
  const auto touch = ball->intersect({{1, 0, -1e4}, {0, 0, 1}}, kEverywhere);
  ASSERT_TRUE(touch);
  EXPECT_EQ(touch->t, 1e4);
  EXPECT_EQ(touch->n, Vec3d(1, 0, 0));
  EXPECT_FALSE(ball->intersect({{std::nextafter(1.0, 2.0), 0, -1e4}, {0, 0, 1}}, kEverywhere));
}

TEST(Sphere, is_round_far_from_the_origin) {
  const Vec3d center(150000, -150000, 150000);
  const auto here = sphere({0, 0, 0}, 0.5), there = sphere(center, 0.5);
  const Vec3d o(0.25, -0.125, 8), d(0, 0, -1);
  const auto near_hit = here->intersect({o, d}, kEverywhere),
             far_hit = there->intersect({center + o, d}, kEverywhere);
  ASSERT_TRUE(near_hit && far_hit);
  EXPECT_EQ(near_hit->t, far_hit->t);
  EXPECT_EQ(near_hit->n, far_hit->n);
}

TEST(Plane, is_seen_from_both_sides) {
  const auto ground = plane({0, 1, 0}, {0, 2, 0});
  const auto from_above = ground->intersect({{5, 4, 5}, {0, -1, 0}}, kEverywhere);
  ASSERT_TRUE(from_above);
  EXPECT_EQ(from_above->t, 3.0);
  EXPECT_EQ(from_above->n, Vec3d(0, 1, 0));
  EXPECT_EQ(ground->intersect({{5, -1, 5}, {0, 1, 0}}, kEverywhere)->n, Vec3d(0, -1, 0));
  EXPECT_FALSE(ground->intersect({{5, 4, 5}, {0, 1, 0}}, kEverywhere));
  EXPECT_FALSE(ground->intersect({{5, 4, 5}, {0, -1, 0}}, {0.0, 3.0}));
}

TEST(Plane, parallel_rays_miss_even_within_it) {
  const auto ground = plane({0, 0, 0}, {0, 1, 0});
  for (const double height : {1.0, 0.0, -0.0, -1.0}) {
    for (const double zero : {0.0, -0.0}) {
      EXPECT_FALSE(ground->intersect({{0, height, 0}, {1, zero, 0}}, kEverywhere));
    }
  }
}

TEST(Plane, refuses_a_normal_that_is_none) {
  for (const double bad : {0.0, kInf, kNaN}) {
    std::vector<std::string> problems;
    make_plugin<Shape>("plane", {{"normal", Vec3d(0, bad, 0)}}, &problems);
    ASSERT_EQ(problems.size(), 1u);
    EXPECT_EQ(problems[0], "normal is zero or not finite; expected a direction");
  }
}

TEST(Plane, is_flat_far_from_the_origin) {
  const Vec3d offset(150000, 150000, -150000);
  const auto ground = plane(offset, {0, 1, 0});
  const Vec3d d = normalize(Vec3d(1, -1e-3, 0));
  const auto hit = ground->intersect({offset + Vec3d(0, 2, 0), d}, kEverywhere);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->t * -d.y, 2.0, 1e-15);
}

/// Hits are finite, inside the segment and have a unit normal on the near side, whatever the ray.
TEST(Shapes, answer_hostile_rays_soundly) {
  const double values[] = {0.0, -0.0, 1.0, -1.0, 1e-320, 1e200, -1e308, kInf, -kInf, kNaN};
  const auto ball = sphere({0.5, 0, 0}, 1.0);
  const auto ground = plane({0, -1, 0}, {0.3, 1, 0});
  for (const double a : values) {
    for (const double b : values) {
      for (const Ray& ray : {Ray{{a, b, 1}, {0, 0, -1}}, Ray{{0, 0, 3}, {a, b, -1}},
                             Ray{{a, 0, 0}, {b, -1, a}}, Ray{{b, 3, a}, {0, -1, 0}}}) {
        for (const Shape* shape : {ball.get(), ground.get()}) {
          for (const Segment segment :
               {kEverywhere, Segment{-5.0, 5.0}, Segment{kNaN, 1.0}, Segment{1.0, -1.0}}) {
            const auto hit = shape->intersect(ray, segment);
            if (!hit) continue;
            ASSERT_TRUE(std::isfinite(hit->t));
            ASSERT_TRUE(hit->t > segment.t0 && hit->t < segment.t1);
            ASSERT_FALSE(std::isnan(hit->error));
          }
        }
      }
    }
  }
}

class ShadowRays : public testing::Test {
 protected:
  std::mt19937 m_random{11};

  double uniform() { return std::uniform_real_distribution<double>(-1.0, 1.0)(m_random); }
  Vec3d direction() {
    for (;;) {
      const Vec3d v(uniform(), uniform(), uniform());
      if (v.length2() <= 1.0 && v.length2() > 1e-4) return normalize(v);
    }
  }
  /// Sends a shadow ray from the hit to the side the viewer is on; the surface must not shadow itself.
  /// Returns whether there was a hit at all.
  bool leaves(const Shape& shape, const Ray& ray) {
    const auto hit = shape.intersect(ray, kEverywhere);
    if (!hit) return false;
    Vec3d wi = direction();
    if (dot(wi, hit->n) < 0.0) wi = -wi;
    if (dot(wi, hit->n) < 1e-9) return false;  // in the surface itself, where it receives no light
    const Ray shadow{offset_point(ray.at(hit->t), hit->n, hit->error), wi};
    const auto again = shape.intersect(shadow, kEverywhere);
    EXPECT_FALSE(again) << "origin " << ray.o << " direction " << ray.d << " hit itself at " << again->t;
    return true;
  }
};

TEST_F(ShadowRays, leave_spheres_of_all_sizes_and_places) {
  int hits = 0;
  for (int i = 0; i < 300000; ++i) {
    const double radius = std::exp2(25.0 * uniform()), place = std::exp2(20.0 * uniform());
    const Vec3d center = place * direction();
    // From outside, aimed anywhere between the middle and the very rim.
    const double rim = 1.0 - std::exp2(-30.0 * std::abs(uniform()));
    const Vec3d view = direction();
    const Vec3d side = normalize(cross(view, direction()));
    const double away = radius * (1.0 + std::exp2(15.0 * uniform()));
    const Ray ray{center + rim * radius * side - away * view, view};
    hits += leaves(*sphere(center, radius), ray);
    if (HasFailure()) return;
  }
  EXPECT_GT(hits, 200000);
}

TEST_F(ShadowRays, leave_planes_at_grazing_angles) {
  int hits = 0;
  for (int i = 0; i < 300000; ++i) {
    const Vec3d point = std::exp2(20.0 * uniform()) * direction(), normal = direction();
    const Vec3d along = normalize(cross(normal, direction()));
    const Ray ray{point + std::exp2(10.0 * uniform()) * normal + std::exp2(15.0 * uniform()) * along,
                  normalize(along - std::exp2(-20.0 * std::abs(uniform())) * normal)};
    hits += leaves(*plane(point, normal), ray);
    if (HasFailure()) return;
  }
  EXPECT_GT(hits, 200000);
}

TEST_F(ShadowRays, error_bounds_the_distance_from_the_surface) {
  for (int i = 0; i < 100000; ++i) {
    const double radius = std::exp2(25.0 * uniform());
    const Vec3d center = std::exp2(20.0 * uniform()) * direction();
    const Ray ray{center + std::exp2(10.0 * uniform()) * radius * direction(), direction()};
    const auto hit = sphere(center, radius)->intersect(ray, kEverywhere);
    if (!hit) continue;
    const Vec3d p = ray.at(hit->t);
    const long double x = p.x, y = p.y, z = p.z;
    const long double distance = std::hypot(x - center.x, y - center.y, z - center.z);
    ASSERT_LE(std::abs(distance - radius), hit->error);
  }
}

TEST_F(ShadowRays, start_no_farther_out_than_rounding_demands) {
  const auto ball = sphere({150000, 0, 0}, 1.0);
  const auto hit = ball->intersect({{150000, 0, 10}, {0, 0, -1}}, kEverywhere);
  ASSERT_TRUE(hit);
  EXPECT_LT(hit->error, 1e-9);
}

}  // namespace
}  // namespace pileus
