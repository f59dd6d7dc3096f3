#include "lib/math/dielectric.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace pileus {
namespace {

using Real = long double;

/// As textbooks have it, in higher precision.
struct Textbook {
  Real cosine, eta;
  Real sine_t() const { return std::sqrt(1.0L - cosine * cosine) / eta; }
  Real q2() const { return cosine * cosine + eta * eta - 1.0L; }
  Real reflectance() const {
    if (!(q2() > 0)) return 1;
    const Real cos_t = std::sqrt(q2()) / eta;
    const Real s = (cosine - eta * cos_t) / (cosine + eta * cos_t);
    const Real p = (eta * cosine - cos_t) / (eta * cosine + cos_t);
    return 0.5L * (s * s + p * p);
  }
};

TEST(Dielectric, reflectance_agrees_with_long_double) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  for (int i = 0; i < 20000; ++i) {
    const double cosine = i % 3 == 0 ? std::pow(any(random), 6) : any(random);
    const double eta = std::exp(i % 2 == 0 ? 1.2 * (any(random) - 0.5) : 1e-3 * (any(random) - 0.5));
    const Textbook twin{cosine, eta};
    if (std::abs(twin.q2()) < 1e-12L) continue;  // next to the critical angle both are worth little
    ASSERT_NEAR(fresnel_reflectance(cosine, eta), double(twin.reflectance()),
                2e-15 / std::sqrt(double(std::abs(twin.q2()))))
        << cosine << " " << eta;
  }
}

TEST(Dielectric, weak_reflections_keep_their_digits) {
  // Where eta is 1 + e, the textbook's differences lose what is reflected; here the limit is (e / 2)^2.
  for (const double e : {1e-3, 1e-6, 1e-9}) {
    const double eta = 1.0 + e, exact = std::pow((eta - 1.0) / (eta + 1.0), 2);
    EXPECT_NEAR(fresnel_reflectance(1.0, eta) / exact, 1.0, 1e-14) << e;
  }
  EXPECT_EQ(fresnel_reflectance(0.5, 1.0), 0.0);
}

TEST(Dielectric, reflects_the_same_share_from_both_sides) {
  for (const double cosine : {1.0, 0.9, 0.5, 0.1, 1e-3}) {
    const Vec3d wo(std::sqrt(1.0 - cosine * cosine), cosine, 0.0), n(0, 1, 0);
    const Vec3d inside = *refracted(n, wo, 1.5);
    EXPECT_NEAR(fresnel_reflectance(-inside.y, 1.0 / 1.5), fresnel_reflectance(cosine, 1.5), 1e-15 / cosine);
  }
  EXPECT_NEAR(fresnel_reflectance(1.0, 1.5), 0.04, 1e-16);
  EXPECT_NEAR(fresnel_reflectance(0.0, 1.5), 1.0, 1e-15);
}

TEST(Dielectric, snell_holds) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  int passed = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3d n = normalize(Vec3d(any(random), any(random), any(random)));
    Vec3d wo = normalize(Vec3d(any(random), any(random), any(random)));
    if (dot(n, wo) < 0.0) wo = -wo;
    const double eta = std::exp(any(random));
    const auto t = refracted(n, wo, eta);
    if (!t) continue;
    ++passed;
    ASSERT_NEAR(length(*t), 1.0, 4e-16);
    ASSERT_LE(dot(*t, n), 0.0);
    ASSERT_NEAR(length(cross(n, *t)) * eta, length(cross(n, wo)), 4e-15 * eta);
    ASSERT_NEAR(dot(cross(n, wo), *t), 0.0, 1e-15) << "in one plane";
  }
  EXPECT_GT(passed, 3000);
}

TEST(Dielectric, nothing_bends_where_nothing_changes) {
  const Vec3d wo = normalize(Vec3d(0.3, 0.2, -0.7));
  EXPECT_NEAR(length(*refracted(Vec3d(0, 0, -1), wo, 1.0) + wo), 0.0, 3e-16);
}

TEST(Dielectric, total_reflection_begins_at_the_critical_angle_to_the_last_bit) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> index(1.001, 3.0);
  for (int i = 0; i < 2000; ++i) {
    const double eta = 1.0 / index(random);
    const Real critical = std::sqrt((1.0L - Real(eta)) * (1.0L + Real(eta)));
    const double near = double(critical);
    const double below = std::nextafter(near, 0.0), above = std::nextafter(near, 1.0);
    for (const double cosine : {below, near, above}) {
      const Real q2 = (Real(cosine) - critical) * (Real(cosine) + critical);
      if (std::abs(q2) < 1e-18L) continue;  // long double cannot tell either
      EXPECT_EQ(squared_refracted_cosine(cosine, eta) > 0.0, q2 > 0.0L) << eta << " " << cosine;
    }
    EXPECT_EQ(fresnel_reflectance(below, eta), 1.0);
    EXPECT_LT(fresnel_reflectance(above, eta), 1.0);
    EXPECT_FALSE(squared_refracted_cosine(below, eta) > 0.0);
    EXPECT_TRUE(squared_refracted_cosine(above, eta) > 0.0);
  }
}

TEST(Dielectric, all_angles_and_indices_give_a_share) {
  for (const double eta : {1e-8, 0.2, 1.0 - 1e-16, 1.0, 1.0 + 1e-15, 2.4, 1e8}) {
    for (const double cosine : {0.0, 1e-300, 1e-8, 0.5, 1.0 - 1e-16, 1.0, 1.0 + 2e-16}) {
      const double share = fresnel_reflectance(cosine, eta);
      EXPECT_TRUE(share >= 0.0 && share <= 1.0 + 1e-15) << eta << " " << cosine << ": " << share;
    }
  }
}

}  // namespace
}  // namespace pileus
