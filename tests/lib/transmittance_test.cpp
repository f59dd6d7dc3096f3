#include "lib/math/transmittance.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/math/compositor.h"

namespace pileus {
namespace {

template <class T>
class Transmittance : public testing::Test {
 protected:
  static constexpr T kInf = std::numeric_limits<T>::infinity();
  std::mt19937 m_random{7};

  T uniform() { return std::uniform_real_distribution<T>(0, 1)(m_random); }
  static T ulp(T x) { return std::nextafter(std::abs(x), kInf) - std::abs(x); }
};

using Formats = testing::Types<float, double>;
TYPED_TEST_SUITE(Transmittance, Formats);

/// (1 - phi1, phi1 - exp(-tau)) by the all-positive series of exp(tau) times themselves, in long double.
SourceWeights<long double> reference_weights(long double tau) {
  if (tau > 40) return {1 - 1 / tau, 1 / tau};      // exp(-40) is beyond double
  long double term = tau / 2, front = 0, back = 0;  // tau^k / (k + 1)!
  for (int k = 1; k < 200; ++k) {
    front += k * term;
    back += term;
    term *= tau / (k + 2);
  }
  return {front * std::exp(-tau), back * std::exp(-tau)};
}

TYPED_TEST(Transmittance, source_weights_to_four_ulp) {
  using T = TypeParam;
  for (int i = 0; i < 200000; ++i) {
    const T tau = i % 2 ? 4 * this->uniform() : std::exp2(120 * this->uniform() - 100);
    const SourceWeights<T> got = source_weights(tau);
    const SourceWeights<long double> expected = reference_weights(tau);
    ASSERT_NEAR(got.front, expected.front, 4 * this->ulp(T(expected.front))) << tau;
    ASSERT_NEAR(got.back, expected.back, 4 * this->ulp(T(expected.back))) << tau;
  }
}

TYPED_TEST(Transmittance, weights_add_up_to_the_opacity) {
  using T = TypeParam;
  for (int i = 0; i < 10000; ++i) {
    const T tau = std::exp2(60 * this->uniform() - 40);
    const SourceWeights<T> weights = source_weights(tau);
    ASSERT_NEAR(weights.front + weights.back, opacity_from_tau(tau), 5 * this->ulp(opacity_from_tau(tau)));
  }
}

TYPED_TEST(Transmittance, limits) {
  using T = TypeParam;
  const T inf = this->kInf;
  EXPECT_EQ(transmittance(T(0)), T(1));
  EXPECT_EQ(transmittance(inf), T(0));
  EXPECT_EQ(opacity_from_tau(inf), T(1));
  EXPECT_EQ(phi1(T(0)), T(1));
  EXPECT_EQ(phi1(inf), T(0));
  EXPECT_EQ(source_weights(T(0)).front, T(0));
  EXPECT_EQ(source_weights(inf).front, T(1));
  EXPECT_EQ(source_weights(inf).back, T(0));
  EXPECT_EQ(extinction_from_opacity(T(1)), inf);
  EXPECT_EQ(extinction_from_opacity(T(-0.5)), T(0));
  EXPECT_EQ(opacity(T(0.5), inf), T(1));
  EXPECT_EQ(opacity(T(0), inf), T(0));
  EXPECT_EQ(opacity(T(2), T(0)), T(0));
  EXPECT_EQ(opacity(std::numeric_limits<T>::denorm_min(), T(1)), std::numeric_limits<T>::denorm_min());
}

TYPED_TEST(Transmittance, opacity_grows_with_the_length) {
  using T = TypeParam;
  for (const T omega : {T(1e-7), T(0.3), T(0.999)}) {
    T last = 0;
    for (T length = T(1e-6); length < T(1e6); length *= T(1.25)) {
      const T now = opacity(omega, length);
      ASSERT_GE(now, last);
      ASSERT_LE(now, T(1));
      last = now;
    }
  }
}

TYPED_TEST(Transmittance, splitting_a_segment_changes_nothing) {
  using T = TypeParam;
  using Colour = Imath::Vec3<T>;
  for (int i = 0; i < 2000; ++i) {
    const T tau = std::exp2(12 * this->uniform() - 9);
    const Colour front(this->uniform()), back(this->uniform()), background(this->uniform());
    Compositor<T> whole, halves;
    whole.add_gradient(tau, front, back);
    const T cut = this->uniform();
    const Colour middle = front * (1 - cut) + back * cut;
    halves.add_gradient(tau * cut, front, middle);
    halves.add_gradient(tau * (1 - cut), middle, back);
    ASSERT_NEAR(whole.over(background).x, halves.over(background).x, 8 * std::numeric_limits<T>::epsilon());
  }
}

TYPED_TEST(Transmittance, an_opaque_surface_hides_the_background) {
  using T = TypeParam;
  using Colour = Imath::Vec3<T>;
  Compositor<T> compositor;
  compositor.add_segment(T(1), Colour(0));
  EXPECT_FALSE(compositor.done());
  compositor.add_segment(this->kInf, Colour(1));
  compositor.add_segment(this->kInf, Colour(9));  // infinity again must not become no number
  EXPECT_TRUE(compositor.done());
  EXPECT_EQ(compositor.tau(), this->kInf);
  EXPECT_EQ(compositor.over(Colour(100)).x, transmittance(T(1)));
}

TYPED_TEST(Transmittance, stopping_early_costs_at_most_the_spread_behind) {
  using T = TypeParam;
  using Colour = Imath::Vec3<T>;
  const T zeta = T(0.01);
  Compositor<T> stopped(zeta), whole;
  while (!stopped.done()) {
    stopped.add_segment(T(0.1), Colour(1));
    whole.add_segment(T(0.1), Colour(1));
  }
  whole.add_segment(T(3), Colour(1));
  // A background as bright as the medium: what remains is added, so nothing at all is lost.
  EXPECT_NEAR(stopped.over(Colour(1)).x, T(1), 16 * std::numeric_limits<T>::epsilon());
  EXPECT_LE(std::abs(stopped.over(Colour(0)).x - whole.over(Colour(0)).x), zeta);
}

TYPED_TEST(Transmittance, sum_survives_cancellation_and_infinity) {
  using T = TypeParam;
  NeumaierSum<T> sum;
  const T large = std::exp2(T(std::numeric_limits<T>::digits + 5));
  for (const T term : {T(1), large, T(1), -large}) sum.add(term);
  EXPECT_EQ(sum.value(), T(2));
  sum.add(this->kInf);
  sum.add(T(1));
  EXPECT_EQ(sum.value(), this->kInf);
}

}  // namespace
}  // namespace pileus
