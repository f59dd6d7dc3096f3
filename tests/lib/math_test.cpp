#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "lib/math/henyey_greenstein.h"
#include "lib/math/lerp.h"
#include "lib/math/offset_point.h"
#include "lib/math/specular.h"
#include "lib/math/two_product.h"
#include "lib/math/unit_vector.h"

namespace pileus {
namespace {

TEST(Lerp, is_exact_at_both_ends) {
  EXPECT_EQ(lerp(0.1, 0.7, 0.0), 0.1);
  EXPECT_EQ(lerp(0.1, 0.7, 1.0), 0.7);
  EXPECT_EQ(lerp(1e300, 1e-300, 1.0), 1e-300);
}

TEST(TwoProduct, value_and_error_are_the_product) {
  for (float a = 1; a < 2; a += 0.00917F) {
    for (float b = -2; b < 2; b += 0.0131F) {
      const TwoProduct<float> product = two_product(a, b);
      ASSERT_EQ(double(product.value) + product.error, double(a) * b);
      ASSERT_EQ(product.value, a * b);
    }
  }
  const double third = 1.0 / 3.0;
  EXPECT_EQ(two_product(third, third).error, std::fma(third, third, -(third * third)));
}

TEST(UnitVector, of_the_largest_and_the_smallest_vectors) {
  for (const double size : {std::numeric_limits<double>::denorm_min(), 1e-320, 1e-200, 1.0, 1e200, 1e308}) {
    const auto unit = unit_vector(Vec3d(size, 0, -size));
    ASSERT_TRUE(unit.has_value()) << size;
    EXPECT_NEAR(unit->x, std::numbers::sqrt2 / 2, 1e-15);
    EXPECT_NEAR(unit->z, -std::numbers::sqrt2 / 2, 1e-15);
  }
}

TEST(UnitVector, refuses_what_has_no_direction) {
  const double inf = std::numeric_limits<double>::infinity(), nan = std::nan("");
  for (const Vec3d& v : {Vec3d(0, 0, 0), Vec3d(0, -0.0, 0), Vec3d(inf, 0, 0), Vec3d(1, nan, 0)}) {
    EXPECT_EQ(unit_vector(v), std::nullopt);
  }
}

TEST(SpecularPower, ends) {
  EXPECT_EQ(specular_power(0.0, 1000.0), 1.0);
  EXPECT_EQ(specular_power(1.0, 1.0), 0.0);
  EXPECT_EQ(specular_power(2.0, 1.0), 0.0);
  EXPECT_NEAR(specular_power(0.5, 2.0), 0.25, 1e-16);
}

/// The share of the lobe from straight back up to a scattering angle is xi: by Simpson's rule over the
/// logarithm of the distance from the peak.
template <class T>
double share_up_to(T g, const ScatteringAngle<T>& angle) {
  constexpr int kIntervals = 2000;
  const bool is_forward = g >= 0;
  // Integrate over the side of the peak, and from the other side when the angle lies there.
  const double x = is_forward ? angle.one_minus_cos : angle.one_plus_cos;
  const double from = std::log(x), to = std::log(2.0);
  double sum = 0.0;
  for (int i = 0; i <= kIntervals; ++i) {
    const double weight = i == 0 || i == kIntervals ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    const double at = std::exp(from + (to - from) * i / kIntervals);
    sum += weight * at *
           (is_forward ? henyey_greenstein(double(g), at, 2.0 - at)
                       : henyey_greenstein(double(g), 2.0 - at, at));
  }
  const double tail = 2.0 * std::numbers::pi * sum * (to - from) / kIntervals / 3.0;
  return is_forward ? tail : 1.0 - tail;
}

template <class T>
class HenyeyGreenstein : public testing::Test {};
using Formats = testing::Types<float, double>;
TYPED_TEST_SUITE(HenyeyGreenstein, Formats);

TYPED_TEST(HenyeyGreenstein, samples_follow_the_phase_function) {
  using T = TypeParam;
  for (const T g : {T(-0.999), T(-0.5), T(-1e-6), T(0), T(1e-4), T(0.3), T(0.85), T(0.9999)}) {
    for (const T xi : {T(0.001), T(0.1), T(0.25), T(0.5), T(0.9), T(0.999)}) {
      const auto angle = sample_henyey_greenstein(g, xi);
      EXPECT_NEAR(share_up_to(g, angle), xi, 4e-6) << "g " << g << " xi " << xi;
      const T value = henyey_greenstein(g, angle.one_minus_cos, angle.one_plus_cos);
      EXPECT_NEAR(angle.pdf / value, 1, 40 * std::numeric_limits<T>::epsilon());
      EXPECT_NEAR(angle.sin() * angle.sin() + angle.cos() * angle.cos(), 1,
                  8 * std::numeric_limits<T>::epsilon());
    }
  }
}

TYPED_TEST(HenyeyGreenstein, is_finite_for_the_sharpest_lobes) {
  using T = TypeParam;
  const T sharpest = std::nextafter(T(1), T(0));
  for (const T g : {sharpest, -sharpest, T(0), std::numeric_limits<T>::denorm_min()}) {
    for (const T x : {T(0), std::numeric_limits<T>::denorm_min(), T(1), T(2), std::nextafter(T(2), T(3))}) {
      const T rest = std::max(2 - x, T(0));
      for (const T value : {henyey_greenstein(g, x, rest), henyey_greenstein(g, rest, x)}) {
        EXPECT_TRUE(std::isfinite(value) && value >= 0) << "g " << g << " x " << x;
      }
    }
    for (const T xi : {T(0), std::numeric_limits<T>::denorm_min(), T(0.5), std::nextafter(T(1), T(0))}) {
      const auto angle = sample_henyey_greenstein(g, xi);
      EXPECT_TRUE(angle.one_minus_cos >= 0 && angle.one_plus_cos >= 0 && std::isfinite(angle.pdf));
      EXPECT_NEAR(angle.one_minus_cos + angle.one_plus_cos, 2, 8 * std::numeric_limits<T>::epsilon());
    }
  }
}

}  // namespace
}  // namespace pileus
