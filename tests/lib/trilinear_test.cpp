#include "lib/math/trilinear.h"

#include <algorithm>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "tests/reference/trilinear_reference.h"

namespace pileus {
namespace {

template <class T>
struct Segment3 {
  Imath::Vec3<T> p, q;
};

template <class T>
class Trilinear : public testing::Test {
 protected:
  std::mt19937 m_random{20};

  T uniform() { return std::uniform_real_distribution<T>(0, 1)(m_random); }
  Imath::Vec3<T> point() { return {uniform(), uniform(), uniform()}; }
  /// Densities >= 0 of very different sizes, zero among them.
  std::array<T, 8> corners() {
    std::array<T, 8> result;
    for (T& corner : result) corner = uniform() < T(0.2) ? T(0) : std::exp2(T(40) * uniform() - T(20));
    return result;
  }
};

using Formats = testing::Types<float, double>;
TYPED_TEST_SUITE(Trilinear, Formats);

TYPED_TEST(Trilinear, mean_agrees_with_gauss_to_a_few_roundings) {
  using T = TypeParam;
  const long double u = std::numeric_limits<T>::epsilon() / 2;
  for (int i = 0; i < 100000; ++i) {
    const std::array<T, 8> corners = this->corners();
    const Segment3<T> segment{this->point(), this->point()};
    const long double expected = reference::trilinear_mean(corners, segment.p, segment.q);
    const T got = bernstein_mean(trilinear_bernstein(corners, segment.p, segment.q));
    ASSERT_NEAR(got, expected, 16 * u * expected);
  }
}

TYPED_TEST(Trilinear, control_values_bound_the_density) {
  using T = TypeParam;
  const long double slack = 16 * std::numeric_limits<T>::epsilon();
  for (int i = 0; i < 2000; ++i) {
    const std::array<T, 8> corners = this->corners();
    const Imath::Vec3<T> p = this->point(), q = this->point();
    const std::array<T, 4> b = trilinear_bernstein(corners, p, q);
    const auto [least, most] = std::minmax_element(b.begin(), b.end());
    for (int k = 0; k <= 16; ++k) {
      const auto at = [t = k / 16.0L](long double a, long double c) { return a + t * (c - a); };
      const long double density = reference::trilinear(corners, at(p.x, q.x), at(p.y, q.y), at(p.z, q.z));
      ASSERT_GE(density, *least * (1 - slack));
      ASSERT_LE(density, *most * (1 + slack));
    }
  }
}

TYPED_TEST(Trilinear, ends_are_exact_at_corners) {
  using T = TypeParam;
  const std::array<T, 8> corners{1, 2, 4, 8, 16, 32, 64, 128};
  for (int i = 0; i < 8; ++i) {
    const Imath::Vec3<T> at(T(i & 1), T(i >> 1 & 1), T(i >> 2));
    const std::array<T, 4> b = trilinear_bernstein(corners, at, at);
    EXPECT_EQ(b[0], corners[size_t(i)]);
    EXPECT_EQ(b[3], corners[size_t(i)]);
  }
}

TYPED_TEST(Trilinear, reversing_the_segment_reverses_the_values) {
  using T = TypeParam;
  for (int i = 0; i < 1000; ++i) {
    const std::array<T, 8> corners = this->corners();
    const Imath::Vec3<T> p = this->point(), q = this->point();
    const std::array<T, 4> there = trilinear_bernstein(corners, p, q),
                           back = trilinear_bernstein(corners, q, p);
    for (size_t k = 0; k < 4; ++k) {
      ASSERT_NEAR(there[k], back[3 - k], 16 * std::numeric_limits<T>::epsilon() * there[k]);
    }
  }
}

TYPED_TEST(Trilinear, empty_cell_gives_exactly_zero) {
  using T = TypeParam;
  for (const T b : trilinear_bernstein(std::array<T, 8>{}, this->point(), this->point())) EXPECT_EQ(b, T(0));
}

}  // namespace
}  // namespace pileus
