#include "lib/freeform/free_form.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "lib/freeform/shapes.h"
#include "tests/fixtures/random_forms.h"

namespace pileus {
namespace {

/// A quadric with every coefficient set: no symmetry hides a mistake.
Quadric general_quadric() {
  return Quadric(Frame({1, -2, 0.5}, {2, 0.5, 3}), {.a11 = -1.5,
                                                    .a22 = 0.75,
                                                    .a33 = -0.5,
                                                    .a12 = 0.3,
                                                    .a13 = -0.6,
                                                    .a23 = 0.9,
                                                    .a14 = 0.1,
                                                    .a24 = -0.2,
                                                    .a34 = 0.4,
                                                    .a44 = 0.25});
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
  EXPECT_EQ(far_away.value(p + far_away.frame().center()), near_by.value(p));
}

TEST(Quadric, range_covers_every_point_and_is_exact_without_cross_terms) {
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
      const Interval range = q.range(box);
      for (int i = 0; i < 100; ++i) {
        const Vec3d p(in_between(box.min.x, box.max.x), in_between(box.min.y, box.max.y),
                      in_between(box.min.z, box.max.z));
        ASSERT_TRUE(range.contains(q.value(p)));
      }
      if (q.coefficients().has_cross_terms()) continue;
      Vec3d nearest, farthest;  // of an ellipsoid's box: where its value is largest and smallest
      for (int axis = 0; axis < 3; ++axis) {
        const double centre = q.frame().center()[axis];
        nearest[axis] = std::clamp(centre, box.min[axis], box.max[axis]);
        farthest[axis] = centre - box.min[axis] > box.max[axis] - centre ? box.min[axis] : box.max[axis];
      }
      EXPECT_NEAR(range.hi, q.value(nearest), 1e-12);
      EXPECT_NEAR(range.lo, q.value(farthest), 1e-12);
    }
  }
}

TEST(FreeForm, is_made_of_a_quadric) {
  const FreeForm form = ellipsoid({0, 1, 0}, {3, 1, 2});
  EXPECT_EQ(form.value({0, 1, 0}), 1.0);
  EXPECT_EQ(form.bounds().min, Vec3d(-3, 0, -2));
  EXPECT_EQ(form.bounds().max, Vec3d(3, 2, 2));
}

TEST(FreeForm, points_that_are_not_finite_are_not_inside) {
  const FreeForm form;
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(form.value({infinity, 0, 0}) >= 0);
  EXPECT_FALSE(form.value({0, std::nan(""), 0}) >= 0);
}

TEST(FreeForm, upper_bound_never_rejects_a_point_of_the_solid) {
  const Vec3d center(1e7, -3e6, 0.1), radii(3, 1, 2);
  const FreeForm form = ellipsoid(center, radii);
  std::mt19937_64 random(45);
  std::uniform_real_distribution<double> angle(0, 6.283185307179586), up(-1, 1), size(0, 1e-6);
  for (int n = 0; n < 5000; ++n) {  // boxes that touch the surface from outside
    const double a = angle(random), y = up(random), r = std::sqrt(1 - y * y);
    const Vec3d p = center + radii * Vec3d(r * std::cos(a), y, r * std::sin(a));
    if (!(form.value(p) >= 0)) continue;
    const Vec3d outwards = -form.gradient(p) * size(random);
    Box3d box(p);
    box.extendBy(p + outwards);
    EXPECT_GE(form.upper_bound(box), form.value(p));
  }
}

TEST(FreeForm, gradients_agree_with_differences) {
  RandomForms forms(46);
  int checked = 0;
  for (int n = 0; n < 3000; ++n) {
    const FreeForm form = forms.form(forms.pick(4));
    const Vec3d p = forms.point(3), gradient = form.gradient(p);
    const double scale = 1 + std::fabs(form.value(p)) + gradient.length();
    for (int axis = 0; axis < 3; ++axis) {
      const auto difference = [&](double step) {
        Vec3d offset(0.0);
        offset[axis] = step;
        return (form.value(p + offset) - form.value(p - offset)) / (2 * step);
      };
      // Where halving the step still changes much, an edge or a cut is near.
      const double coarse = difference(2e-6), fine = difference(1e-6);
      if (std::fabs(coarse - fine) > 1e-6 * scale) continue;
      ++checked;
      ASSERT_NEAR(gradient[axis], fine, 1e-5 * scale) << "form " << n << ", axis " << axis;
    }
  }
  EXPECT_GT(checked, 6000);
}

TEST(FreeForm, a_morph_has_its_ends) {
  RandomForms forms(47);
  for (int n = 0; n < 200; ++n) {
    const FreeForm from = forms.form(2), to = forms.form(2);
    const Vec3d p = forms.point(3);
    if (!std::isfinite(from.value(p)) || !std::isfinite(to.value(p))) continue;
    EXPECT_EQ(morphed(from, to, 0.0).value(p), from.value(p));
    EXPECT_EQ(morphed(from, to, 1.0).value(p), to.value(p));
    const double half = morphed(from, to, 0.5).value(p);
    EXPECT_DOUBLE_EQ(half, (from.value(p) + to.value(p)) / 2);
  }
}

TEST(FreeForm, smooth_joins_approach_the_sharp_ones_and_stay_on_their_side) {
  RandomForms forms(48);
  for (int n = 0; n < 500; ++n) {
    const FreeForm a = forms.form(1), b = forms.form(1);
    const Vec3d p = forms.point(3);
    for (const Join kind : {Join::unite, Join::intersect, Join::subtract}) {
      const double sharp = joined(kind, a, b).value(p);
      const double slack = 1e-12 * (std::fabs(a.value(p)) + std::fabs(b.value(p)));
      for (const double smooth : {0.5, 0.05, 0.005}) {
        const double soft = joined(kind, a, b, {.smooth = smooth}).value(p);
        EXPECT_LE(std::fabs(soft - sharp), smooth / 2 + slack);
        EXPECT_GE(kind == Join::unite ? soft - sharp : sharp - soft, -slack);
      }
      const double nearly = joined(kind, a, b, {.alpha = 1 - 1e-12}).value(p);
      EXPECT_NEAR(nearly, sharp, 2e-6 * (std::fabs(a.value(p)) + std::fabs(b.value(p))));
      // Rvachev's functions have the same sign as the sharp ones.
      const double rvachev = joined(kind, a, b, {.alpha = 0.0}).value(p);
      if (std::fabs(sharp) > slack) {
        EXPECT_EQ(rvachev > 0, sharp > 0) << sharp;
      }
    }
  }
}

TEST(FreeForm, a_far_operand_of_a_smooth_join_leaves_the_gradient_alone) {
  // f = -1e17 with a gradient of 1e17: its share in the union is 1e-17 squared, not a rounding of 1.
  const FreeForm near = plane({0, 0, 0}, {1, 0, 0}, 1), far = plane({-1, 0, 0}, {1, 0, 0}, 1e-17);
  for (const Blend& blend : {Blend{.alpha = 0.6}, Blend{.smooth = 0.5}, Blend{.alpha = 0.0}}) {
    EXPECT_NEAR(joined(Join::unite, near, far, blend).gradient({0.25, 0, 0}).x, -1.0, 1e-9);
  }
}

TEST(FreeForm, placing_moves_the_function_with_the_solid) {
  RandomForms forms(49);
  for (int n = 0; n < 200; ++n) {
    const FreeForm form = forms.form(2);
    const Affine map = forms.placement();
    const Vec3d p = forms.point(2);
    const double before = form.value(p), scale = 1 + std::fabs(before) + form.gradient(p).length();
    EXPECT_NEAR(placed(form, map).value(map.point(p)), before, 1e-10 * scale) << n;
  }
}

TEST(FreeForm, bounds_of_a_bumpy_form_are_close_to_the_solid) {
  const FreeForm form = perturbed(sphere({0, 0, 0}, 1), {{sphere({1, 0, 0}, 0.5), 0.8}});
  // On the axis the bump ends at 1.2067 (METHODS 16, PRT-01); cells of the search are 1/64 of the first box.
  EXPECT_GE(form.bounds().max.x, 1.2067);
  EXPECT_LE(form.bounds().max.x, 1.25);
  EXPECT_GE(form.bounds().max.y, 1.0 - 1e-12);
  EXPECT_LE(form.bounds().max.y, 1.05);
}

TEST(Deformation, twist_turns_by_the_share_of_the_way) {
  const FreeForm bar = ellipsoid({0, 0, 0}, {1, 4, 0.2});
  const FreeForm twisted =
      deformed(bar, Deformation::twist({0, 0, 0}, {0, 1, 0}, 0, 2, std::numbers::pi / 2));
  // The frame's first two axes follow the right hand about +y: z turns to x.
  EXPECT_NEAR(twisted.value({0.5, -1, 0}), bar.value({0.5, -1, 0}), 1e-15) << "before it starts";
  EXPECT_NEAR(twisted.value({0, 3, 0.5}), bar.value({0.5, 3, 0}), 1e-12) << "beyond its end: a quarter turn";
  const double half = std::sqrt(0.5);
  EXPECT_NEAR(twisted.value({0.5 * half, 1, -0.5 * half}), bar.value({0.5, 1, 0}), 1e-12) << "half way";
}

TEST(Deformation, taper_scales_the_cross_section) {
  const FreeForm ball = sphere({0, 0, 0}, 2);
  const FreeForm tapered = deformed(ball, Deformation::taper({0, 0, 0}, {0, 0, 1}, 0, 1, 0.5));
  EXPECT_DOUBLE_EQ(tapered.value({0.6, 0, -0.3}), ball.value({0.6, 0, -0.3}));
  EXPECT_DOUBLE_EQ(tapered.value({0.3, 0.1, 1.5}), ball.value({0.6, 0.2, 1.5}));
  EXPECT_DOUBLE_EQ(tapered.value({0.75, 0, 0.5}), ball.value({1, 0, 0.5}));
}

TEST(Deformation, bend_keeps_lengths_along_the_axis) {
  const double length = 2, angle = std::numbers::pi / 2, radius = length / angle;
  const FreeForm bar = ellipsoid({0, 0, 0}, {0.5, 0.5, 5});
  const FreeForm bent = deformed(bar, Deformation::bend({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 0, length, angle));
  EXPECT_DOUBLE_EQ(bent.value({0.1, 0.2, -1}), bar.value({0.1, 0.2, -1})) << "before it starts";
  // Half way along a quarter circle about (radius, 0, 0).
  const double s = std::sqrt(0.5);
  EXPECT_NEAR(bent.value({radius - radius * s, 0, radius * s}), bar.value({0, 0, 1}), 1e-12);
  EXPECT_NEAR(bent.value({radius - (radius - 0.2) * s, 0, (radius - 0.2) * s}), bar.value({0.2, 0, 1}),
              1e-12);
  // One metre beyond the end, where the axis runs along +x.
  EXPECT_NEAR(bent.value({radius + 1, 0, radius}), bar.value({0, 0, 3}), 1e-12);
  EXPECT_NEAR(bent.value({radius + 1, 0, radius - 0.2}), bar.value({0.2, 0, 3}), 1e-12);
}

TEST(Deformation, group_perturbations_act_on_the_whole) {
  const FreeForm pair = joined(Join::unite, sphere({-1, 0, 0}, 0.8), sphere({1, 0, 0}, 0.8));
  const FreeForm dented = perturbed(pair, {{plane_pair({0, 0.5, 0}, {0, 1, 0}, 1), -0.5}});
  for (const double x : {-1.0, 1.0}) EXPECT_LT(dented.value({x, 0.5, 0}), pair.value({x, 0.5, 0}));
  EXPECT_EQ(dented.value({-1, -0.1, 0}), pair.value({-1, -0.1, 0}));
}

}  // namespace
}  // namespace pileus
