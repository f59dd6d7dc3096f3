#include "lib/freeform/free_form.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <variant>

#include <gtest/gtest.h>

#include "lib/core/param_table.h"

namespace pileus {
namespace {

/// A quadric with every coefficient set: no symmetry hides a mistake.
Quadric general_quadric() {
  Quadric q;
  q.center = {1, -2, 0.5};
  q.size = {2, 0.5, 3};
  q.a11 = -1.5, q.a22 = 0.75, q.a33 = -0.5;
  q.a12 = 0.3, q.a13 = -0.6, q.a23 = 0.9;
  q.a14 = 0.1, q.a24 = -0.2, q.a34 = 0.4;
  q.a44 = 0.25;
  return q;
}

TEST(Quadric, value_computed_by_hand) {
  // Local coordinates (1, 2, -1): every term of METHODS 4.1 on its own.
  const Vec3d p = Vec3d(1, -2, 0.5) + Vec3d(2, 1, -3);
  EXPECT_NEAR(general_quadric().value(p), -1.5 + 3.0 - 0.5 + 0.6 + 0.6 - 1.8 + 0.1 - 0.4 - 0.4 + 0.25, 1e-15);
}

TEST(Quadric, gradient_agrees_with_differences) {
  const Quadric q = general_quadric();
  const Vec3d p(0.3, -1.7, 2.1);
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d step(0.0);
    step[axis] = 1e-3;  // central differences of a quadratic have no truncation error
    EXPECT_NEAR(q.gradient(p)[axis], (q.value(p + step) - q.value(p - step)) / 2e-3, 1e-10);
  }
}

TEST(Quadric, ellipsoid_is_one_at_its_centre_and_zero_on_its_surface) {
  const Quadric q = ellipsoid({1, 2, 3}, {3, 1, 2});
  EXPECT_EQ(q.value({1, 2, 3}), 1.0);
  EXPECT_EQ(q.value({4, 2, 3}), 0.0);
  EXPECT_EQ(q.value({1, 1, 3}), 0.0);
  EXPECT_LT(q.value({1, 2, 5.001}), 0.0);
  EXPECT_LT(q.gradient({4, 2, 3}).x, 0.0) << "the gradient points inwards";
}

TEST(Quadric, loses_nothing_far_from_the_origin) {
  const Quadric near_by = ellipsoid({0, 0, 0}, {3, 1, 2}),
                far_away = ellipsoid({1 << 23, 0, 1 << 23}, {3, 1, 2});
  const Vec3d p(0.5, 0.25, -1.125);  // exact when shifted
  EXPECT_EQ(far_away.value(p + far_away.center), near_by.value(p));
}

TEST(Quadric, upper_bound_covers_every_point_and_is_exact_without_cross_terms) {
  std::mt19937_64 random(44);
  std::uniform_real_distribution<double> coordinate(-4, 4);
  const auto in_between = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  for (const Quadric& q : {general_quadric(), ellipsoid({0.5, 0, -1}, {3, 1, 2})}) {
    for (int n = 0; n < 300; ++n) {
      Box3d box;
      for (int corner = 0; corner < 2; ++corner) {
        box.extendBy(Vec3d(coordinate(random), coordinate(random), coordinate(random)));
      }
      const double bound = q.upper_bound(box);
      for (int i = 0; i < 100; ++i) {
        const Vec3d p(in_between(box.min.x, box.max.x), in_between(box.min.y, box.max.y),
                      in_between(box.min.z, box.max.z));
        ASSERT_LE(q.value(p), bound + 1e-12);
      }
      if (q.a12 != 0) continue;
      Vec3d nearest;  // of an ellipsoid's box: where its value is largest
      for (int axis = 0; axis < 3; ++axis) {
        nearest[axis] = std::clamp(q.center[axis], box.min[axis], box.max[axis]);
      }
      EXPECT_NEAR(bound, q.value(nearest), 1e-12);
    }
  }
}

TEST(FreeForm, describes_its_base) {
  FreeForm form;
  ParamTable table;
  form.describe(table);
  ASSERT_EQ(table.params().size(), 1u);
  EXPECT_EQ(table.params()[0].name, "base");

  ParamTable base, ellipsoid_params;
  std::get<GroupSlot>(table.params()[0].target).describe(base);
  ASSERT_EQ(base.params()[0].name, "ellipsoid");
  std::get<GroupSlot>(base.params()[0].target).describe(ellipsoid_params);
  ASSERT_EQ(ellipsoid_params.params().size(), 2u);
  *std::get<Vec3d*>(ellipsoid_params.params()[0].target) = {0, 1, 0};
  *std::get<Vec3d*>(ellipsoid_params.params()[1].target) = {3, 1, 2};

  EXPECT_EQ(form.value({0, 1, 0}), 1.0);
  EXPECT_EQ(form.bounds().min, Vec3d(-3, 0, -2));
  EXPECT_EQ(form.bounds().max, Vec3d(3, 2, 2));
  EXPECT_EQ(range_text(ellipsoid_params.params()[1]), "> 0");
}

TEST(FreeForm, points_that_are_not_finite_are_not_inside) {
  const FreeForm form;
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(form.value({infinity, 0, 0}) >= 0);
  EXPECT_FALSE(form.value({0, std::nan(""), 0}) >= 0);
}

TEST(FreeForm, upper_bound_never_rejects_a_point_of_the_solid) {
  FreeForm form;
  form.base = ellipsoid({1e7, -3e6, 0.1}, {3, 1, 2});
  std::mt19937_64 random(45);
  std::uniform_real_distribution<double> angle(0, 6.283185307179586), up(-1, 1), size(0, 1e-6);
  for (int n = 0; n < 5000; ++n) {  // boxes that touch the surface from outside
    const double a = angle(random), y = up(random), r = std::sqrt(1 - y * y);
    const Vec3d p = form.base.center + form.base.size * Vec3d(r * std::cos(a), y, r * std::sin(a));
    if (!(form.value(p) >= 0)) continue;
    const Vec3d outwards = -form.gradient(p) * size(random);
    Box3d box(p);
    box.extendBy(p + outwards);
    EXPECT_GE(form.upper_bound(box), form.value(p));
  }
}

}  // namespace
}  // namespace pileus
