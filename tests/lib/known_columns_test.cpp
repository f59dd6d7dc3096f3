// What analytic fields say of how their columns bend is hunted for counterexamples.
#include "lib/volume/known_columns.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/volume/analytic_fields.h"
#include "tests/fixtures/hunt.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

class KnownColumnsOf : public testing::Test {
 protected:
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(m_random); }
  double logarithmic(double a, double b) { return a * std::pow(b / a, uniform(0.0, 1.0)); }
  Vec3d point(double reach) {
    return {uniform(-reach, reach), uniform(-reach, reach), uniform(-reach, reach)};
  }

  /// Along an axis now and then: edges of boxes are steep there.
  Vec3d direction() {
    Vec3d axis(0.0);
    axis[int(uniform(0.0, 3.0) * 0.999)] = uniform(-1.0, 1.0) < 0.0 ? -1.0 : 1.0;
    return uniform(0.0, 1.0) < 0.2 ? axis : normalize(axis + point(logarithmic(1e-3, 10.0)));
  }

  static double column(const DensityField& field, const Vec3d& p, const Vec3d& towards) {
    FieldCounters counters;
    return field.column({p, towards}, {0.0, kInfinity}, kInfinity, counters);
  }

  /// Returns the share of the bound that was reached; -1 where nothing bends.
  double expect_within(const DensityField& field) {
    constexpr int kSteps = 40;
    const auto& known = dynamic_cast<const KnownColumns&>(field);
    const double size = field.bounds().size().length();
    const Vec3d towards = direction();
    const double length = size * logarithmic(1e-4, 1.0), t0 = uniform(0.0, size);
    const Vec3d d = direction(), through = field.bounds().center() + 0.6 * field.bounds().size() * point(1.0);
    const Ray ray{through - (t0 + uniform(0.0, 1.0) * length) * d, d};
    const double bend = known.column_bend(ray, {t0, t0 + length}, towards);
    const double c0 = column(field, ray.at(t0), towards), c1 = column(field, ray.at(t0 + length), towards);
    double most = 0.0;
    for (int i = 1; i < kSteps; ++i) {
      const double u = double(i) / kSteps;
      const double c = column(field, ray.at(t0 + u * length), towards);
      most = std::max(most, std::abs(c - (c0 + u * (c1 - c0))));
    }
    EXPECT_LE(most, bend * (1.0 + 1e-9) + 1e-10 * size);
    return bend > 1e-6 * size ? most / bend : -1.0;
  }

  /// The bound holds, and is of use.
  void expect_all_within(const DensityField& field) {
    std::vector<double> shares;
    for (int n = 0; n < hunted(20000) && !HasFailure(); ++n) {
      const double share = expect_within(field);
      if (share >= 0.0) shares.push_back(share);
    }
    ASSERT_GT(shares.size(), 1000u);
    std::sort(shares.begin(), shares.end());
    EXPECT_GT(shares[shares.size() / 2], 0.2);
    EXPECT_GT(shares.back(), 0.48);
  }

 private:
  std::mt19937_64 m_random{7};
};

TEST_F(KnownColumnsOf, a_box_bend_no_more_than_told) {
  expect_all_within(*make_box_field({{-3, -1, 0}, {2, 4, 7}}));
}

TEST_F(KnownColumnsOf, an_ellipsoid_bend_no_more_than_told) {
  expect_all_within(*make_ellipsoid_field({1, 2, -3}, {4, 0.5, 2}));
}

TEST_F(KnownColumnsOf, height_fog_bend_no_more_than_told) {
  expect_all_within(*make_height_fog_field({{-30, 1, -30}, {30, 11, 30}}, 4.0));
  expect_all_within(*make_height_fog_field({{-30, 1, -30}, {30, 11, 30}}, 0.7));
}

/// Where nothing has an edge, the bound of half the part is a quarter of that of the whole.
TEST_F(KnownColumnsOf, height_fog_are_linear_in_small_parts) {
  const auto field = make_height_fog_field({{-3000, 0, -3000}, {3000, 400, 3000}}, 40.0);
  const auto& known = dynamic_cast<const KnownColumns&>(*field);
  const Vec3d towards = normalize(Vec3d(0.3, 0.5, -0.2));
  const Ray ray{{10, 20, 30}, normalize(Vec3d(0.6, 0.3, 0.1))};
  const double whole = known.column_bend(ray, {50, 60}, towards),
               half = known.column_bend(ray, {50, 55}, towards);
  EXPECT_GT(whole, 0.0);
  EXPECT_LT(half, 0.27 * whole);
}

TEST_F(KnownColumnsOf, a_box_that_shades_nothing_do_not_bend) {
  const auto field = make_box_field({{-1, -1, -1}, {1, 1, 1}});
  const auto& known = dynamic_cast<const KnownColumns&>(*field);
  EXPECT_EQ(known.column_bend({{-5, 3, 0}, {1, 0, 0}}, {0, 10}, normalize(Vec3d(0.2, 1, 0))), 0.0);
  EXPECT_EQ(known.column_bend({{-5, 0, 3}, {1, 0, 0}}, {0, 10}, {0, 1, 0}), 0.0);
}

}  // namespace
}  // namespace pileus
