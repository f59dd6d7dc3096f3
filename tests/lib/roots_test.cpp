#include "lib/math/roots.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "tests/reference/roots_reference.h"

namespace pileus {
namespace {

constexpr float kInfF = std::numeric_limits<float>::infinity();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

long double ulp(float x) {
  return static_cast<long double>(std::nextafter(std::abs(x), kInfF)) - std::abs(x);
}

class RandomRoots : public testing::Test {
 protected:
  std::mt19937 m_random{5};

  float uniform() { return std::uniform_real_distribution<float>(-1, 1)(m_random); }
  /// Either sign, 2^-range .. 2^range.
  float wide(float range) { return uniform() * std::exp2(range * uniform()); }
};

void expect_quadratic(float a, float b, float c) {
  const auto expected = reference::quadratic_roots(a, b, c);
  const Roots<float> got = quadratic_roots(a, b, c);
  ASSERT_EQ(got.count, int(expected.size())) << a << " " << b << " " << c;
  for (size_t k = 0; k < expected.size(); ++k) {
    const float rounded = float(expected[k]);
    if (std::abs(rounded) < std::numeric_limits<float>::min() || std::isinf(rounded)) continue;
    ASSERT_NEAR(got.t[k], expected[k], 3 * ulp(rounded)) << a << " " << b << " " << c;
  }
}

TEST_F(RandomRoots, quadratic_to_three_ulp_for_all_exponents) {
  for (int i = 0; i < 200000; ++i) expect_quadratic(wide(100), wide(100), wide(100));
}

TEST_F(RandomRoots, quadratic_to_three_ulp_when_the_roots_nearly_meet) {
  for (int i = 0; i < 200000; ++i) {
    const float a = wide(3), root = wide(3);
    const float b = -2 * a * root * (1 + 1e-6F * uniform());
    const float c = a * root * root * (1 + 1e-6F * uniform());
    expect_quadratic(a, b, c);
  }
}

TEST(QuadraticRoots, survives_the_ends_of_the_range) {
  const double largest = std::numeric_limits<double>::max(),
               least = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(quadratic_roots(1.0, -3e300, 2e300).t[0], 2.0 / 3.0);
  EXPECT_EQ(quadratic_roots(largest, 0.0, -largest).t[1], 1.0);
  EXPECT_EQ(quadratic_roots(least, 0.0, -least).t[0], -1.0);
  EXPECT_EQ(quadratic_roots(1.0, 1e-300, 0.0).t[0], -1e-300) << "c = 0 must not hide b";
  EXPECT_EQ(quadratic_roots(1.0, 0.0, -1e-320).count, 2) << "sqrt of a denormal";
  EXPECT_EQ(quadratic_roots(least, 1e10, 1.0).t[0], -kInf) << "a root beyond the largest number";
}

TEST(QuadraticRoots, has_no_root_where_a_coefficient_is_no_number) {
  for (const double bad : {kInf, -kInf, kNaN}) {
    EXPECT_EQ(quadratic_roots(bad, 1.0, 1.0).count, 0);
    EXPECT_EQ(quadratic_roots(1.0, bad, 1.0).count, 0);
    EXPECT_EQ(quadratic_roots(1.0, 1.0, bad).count, 0);
    EXPECT_EQ(quadratic_roots(0.0, 1.0, bad).count, 0);
  }
}

TEST(Roots, first_in_leaves_out_the_ends) {
  const Roots<double> roots{2, {1.0, 3.0}};
  EXPECT_EQ(roots.first_in(0.0, 5.0), 1.0);
  EXPECT_EQ(roots.first_in(1.0, 5.0), 3.0);
  EXPECT_EQ(roots.first_in(1.0, 3.0), std::nullopt);
  EXPECT_EQ(roots.first_in(kNaN, 5.0), std::nullopt);
}

/// The ray passes the centre at a share of the radius that is not too near 1, where the root of the
/// discriminant magnifies the rounding of the direction itself.
TEST_F(RandomRoots, sphere_hits_near_and_far) {
  for (int i = 0; i < 200000; ++i) {
    const float radius = std::exp2(20 * uniform());
    const float distance = radius * std::exp2(15 * uniform());
    Imath::V3f d(uniform(), uniform(), uniform());
    d.normalize();
    Imath::V3f side = d.cross(Imath::V3f(uniform(), uniform(), uniform())).normalized();
    const Imath::V3f f = side * (radius * 0.9F * uniform()) - d * distance;
    const auto expected = reference::sphere_hits(f, d, radius);
    const Roots<float> got = sphere_hits(f, d, radius);
    ASSERT_EQ(got.count, 2);
    ASSERT_EQ(expected.size(), 2u);
    // The length of a rounded d is off by up to 2 ulp, which moves both hits along the ray.
    const long double scale = std::max({std::abs(expected[0]), std::abs(expected[1])});
    for (size_t k = 0; k < 2; ++k) ASSERT_NEAR(got.t[k], expected[k], 12 * ulp(float(scale)));
  }
}

TEST(SphereHits, none_where_a_value_is_no_number) {
  for (const double bad : {kInf, -kInf, kNaN, 1e200}) {
    EXPECT_EQ(sphere_hits(Vec3d(bad, 0, 0), Vec3d(1, 0, 0), 1.0).count, 0);
    EXPECT_EQ(sphere_hits(Vec3d(0, bad, 0), Vec3d(1, 0, 0), 1.0).count, 0);
  }
  EXPECT_EQ(sphere_hits(Vec3d(0, 0, 0), Vec3d(kNaN, 0, 0), 1.0).count, 0);
  EXPECT_EQ(sphere_hits(Vec3d(0, 0, 0), Vec3d(1, 0, 0), kNaN).count, 0);
}

TEST(SphereHits, from_the_very_centre) {
  const Roots<double> hits = sphere_hits(Vec3d(0.0), Vec3d(0, 1, 0), 2.0);
  ASSERT_EQ(hits.count, 2);
  EXPECT_EQ(hits.t[0], -2.0);
  EXPECT_EQ(hits.t[1], 2.0);
}

}  // namespace
}  // namespace pileus
