// Many shapes by the index and one by one: the same hits, bit for bit.
#include "lib/scene/shape_index.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/math/offset_point.h"
#include "lib/scene/world.h"
#include "tests/shaders_cpu/make_plugin.h"

namespace pileus {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

class ShapeIndexTest : public testing::Test {
 protected:
  std::mt19937 m_random{3};

  double uniform(double a = -1.0, double b = 1.0) {
    return std::uniform_real_distribution<double>(a, b)(m_random);
  }
  Vec3d direction() {
    for (;;) {
      const Vec3d v(uniform(), uniform(), uniform());
      if (v.length2() <= 1.0 && v.length2() > 1e-4) return normalize(v);
    }
  }
  Vec3d axis() {
    Vec3d d(0.0);
    d[int(uniform(0.0, 3.0))] = uniform() < 0.0 ? 1.0 : -1.0;
    return d;
  }

  /// Spheres around a place, of many sizes, some of them twice; two planes among them.
  World world(size_t count, const Vec3d& place) {
    World result;
    for (size_t i = 0; i < count; ++i) {
      if (i % 7 == 3) {
        result.shapes.push_back(result.shapes[i / 2]);
        continue;
      }
      result.shapes.push_back(
          make_plugin<Shape>("sphere", {{"center", place + 10.0 * Vec3d(uniform(), uniform(), uniform())},
                                        {"radius", std::exp2(uniform(-8.0, 1.0))}}));
    }
    for (const double height : {-20.0, 20.0}) {
      const auto plane =
          make_plugin<Shape>("plane", {{"point", place + Vec3d(0, height, 0)}, {"normal", Vec3d(0.1, 1, 0)}});
      result.shapes.insert(result.shapes.begin() + std::ptrdiff_t(count / 2), plane);
    }
    return result;
  }

  /// Towards a sphere: its middle, its rim, or past it; along axes, too; from inside.
  Ray ray(const World& world) {
    const Shape& shape = *world.shapes[size_t(uniform(0.0, double(world.shapes.size()) * 0.999))];
    const Box3d box = shape.bounds();
    const bool is_sphere = std::isfinite(box.max.x);
    const Vec3d center = is_sphere ? 0.5 * box.min + 0.5 * box.max : Vec3d(0.0);
    const double radius = is_sphere ? 0.5 * (box.max.x - box.min.x) : 1.0;
    const Vec3d d = uniform() < -0.4 ? axis() : direction();
    const Vec3d side = normalize(cross(d, direction()));
    const double rim = uniform() < 0.0 ? 1.0 : uniform(0.0, 1.2);  // half of them touch
    const double away = uniform() < -0.6 ? 0.0 : std::exp2(uniform(-2.0, 10.0));
    return {center + rim * radius * side - away * d, d};
  }
};

TEST_F(ShapeIndexTest, finds_what_a_plain_loop_finds) {
  size_t hits = 0;
  for (const double place : {0.0, 1.5e5, 1e7}) {
    for (const size_t count : {0, 2, 30, 600}) {
      const World plain = world(count, place * Vec3d(1.0, -1.0, 0.5));
      World indexed = plain;
      std::vector<const Shape*> shapes;
      for (const auto& shape : plain.shapes) shapes.push_back(shape.get());
      indexed.index = std::make_shared<const ShapeIndex>(shapes);
      for (int n = 0; n < 4000; ++n) {
        const Ray r = ray(plain);
        const Segment segment{uniform() < 0.5 ? 0.0 : uniform(0.0, 5.0),
                              uniform() < 0.0 ? kInf : uniform(5.0, 900.0)};
        const auto expected = nearest_surface(plain, r, segment),
                   found = nearest_surface(indexed, r, segment);
        ASSERT_EQ(expected.has_value(), found.has_value()) << place << " " << r.o << r.d;
        ASSERT_EQ(is_occluded(plain, r, segment), is_occluded(indexed, r, segment));
        if (!expected) continue;
        ++hits;
        ASSERT_EQ(expected->t, found->t);
        ASSERT_EQ(expected->n, found->n);
        ASSERT_EQ(expected->shape, found->shape) << "the first of equals";
      }
    }
  }
  EXPECT_GT(hits, 20000u);
}

TEST_F(ShapeIndexTest, answers_hostile_rays_like_a_plain_loop) {
  const double values[] = {0.0, -0.0, 1.0, -1.0, 1e-320, 1e200, -1e308, kInf, -kInf, std::nan("")};
  const World plain = world(40, Vec3d(0.0));
  World indexed = plain;
  std::vector<const Shape*> shapes;
  for (const auto& shape : plain.shapes) shapes.push_back(shape.get());
  indexed.index = std::make_shared<const ShapeIndex>(shapes);
  for (const double a : values) {
    for (const double b : values) {
      for (Ray r : {Ray{{a, b, 1}, {0, 0, -1}}, Ray{{0, 0, 3}, {a, b, -1}}, Ray{{a, 0, 0}, {b, -1, a}}}) {
        if (std::isfinite(length(r.d))) r.d = normalize(r.d);  // of other lengths shapes make no sense
        for (const Segment segment : {Segment{0.0, kInf}, Segment{-5.0, 5.0}, Segment{std::nan(""), 1.0}}) {
          const auto expected = nearest_surface(plain, r, segment),
                     found = nearest_surface(indexed, r, segment);
          ASSERT_EQ(expected.has_value(), found.has_value()) << r.o << r.d;
          if (expected) {
            ASSERT_EQ(expected->t, found->t);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace pileus
