// Hunts for points where a free form leaves its bounds. PILEUS_HUNT multiplies the number of points.
#include "lib/freeform/form_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include <gtest/gtest.h>

#include "tests/fixtures/random_forms.h"

namespace pileus {
namespace {

int hunt(int boxes) {
  const char* factor = std::getenv("PILEUS_HUNT");
  return factor ? boxes * std::atoi(factor) : boxes;
}

TEST(FormBounds, no_quadric_leaves_its_range) {
  RandomForms forms(61);
  for (int n = 0; n < hunt(20000); ++n) {
    const Quadric quadric = forms.chance(0.5) ? forms.quadric().moved(forms.placement()) : forms.quadric();
    const Box3d box = forms.box();
    const Interval range = quadric.range(box);
    ASSERT_LE(range.lo, range.hi);
    for (int i = 0; i < 10; ++i) {
      const double value = quadric.value(forms.point_in(box));
      ASSERT_LE(range.lo, value) << "box " << n;
      ASSERT_GE(range.hi, value) << "box " << n;
    }
  }
}

TEST(FormBounds, no_form_leaves_its_range_in_double_nor_in_single_precision) {
  RandomForms forms(62);
  for (int n = 0; n < hunt(4000); ++n) {
    const FreeForm form = forms.form(forms.pick(4));
    for (int boxes = 0; boxes < 3; ++boxes) {
      const Box3d box = forms.box();
      const Interval range = form.range(box);
      const LocalForm local = form.within(box);
      std::array<float, 20> x, y, z, f;
      std::array<Vec3d, 20> points;
      for (size_t i = 0; i < f.size(); ++i) {
        points[i] = forms.point_in(box);
        const Vec3d offset = points[i] - local.anchor();
        x[i] = float(offset.x), y[i] = float(offset.y), z[i] = float(offset.z);
      }
      local.values(x, y, z, f);
      for (size_t i = 0; i < f.size(); ++i) {
        const double value = form.value(points[i]);
        ASSERT_LE(range.lo, value) << "form " << n;
        ASSERT_GE(range.hi, value) << "form " << n;
        ASSERT_LE(local.range().lo, double(f[i])) << "form " << n;
        ASSERT_GE(local.range().hi, double(f[i])) << "form " << n;
      }
    }
  }
}

TEST(FormBounds, a_part_of_a_local_form_has_the_values_of_the_whole) {
  RandomForms forms(63);
  for (int n = 0; n < 500; ++n) {
    const FreeForm form = forms.form(3);
    const Box3d box = forms.box();
    Box3d part(forms.point_in(box));
    part.extendBy(forms.point_in(box));
    const LocalForm direct = form.within(part), nested = form.within(box).within(part);
    EXPECT_EQ(direct.range().lo, nested.range().lo);
    EXPECT_EQ(direct.range().hi, nested.range().hi);
    PointLattice lattice;
    lattice.first = part.min;
    lattice.count = {3, 4, 5};
    for (int axis = 0; axis < 3; ++axis) {
      lattice.step[axis] = (part.max[axis] - part.min[axis]) / lattice.count[axis];
    }
    std::vector<float> a(lattice.size()), b(lattice.size());
    direct.values(lattice, a);
    nested.values(lattice, b);
    EXPECT_EQ(a, b);
  }
}

TEST(FormBounds, the_solid_lies_in_its_bounds) {
  RandomForms forms(64);
  int inside = 0;
  for (int n = 0; n < hunt(300); ++n) {
    const FreeForm form = forms.form(forms.pick(4));
    Box3d bounds = form.bounds();
    if (!bounds.isEmpty()) {
      bounds.min -= Vec3d(1e-9), bounds.max += Vec3d(1e-9);
    }
    for (int i = 0; i < 200; ++i) {
      const Vec3d p = forms.point(forms.chance(0.5) ? 4 : 30);
      if (!(form.value(p) >= 0)) continue;
      ++inside;
      ASSERT_TRUE(bounds.intersects(p)) << "form " << n;
    }
  }
  EXPECT_GT(inside, 1000);
}

TEST(FormBounds, endless_quadrics_become_finite_where_others_cut_them) {
  const FreeForm slab = plane_pair({0, 1, 0}, {0, 1, 0}, 2);
  const auto half_width = [&](const Quadric& quadric) {
    return joined(Join::intersect, quadric, slab).bounds().max.x;
  };
  // The shrunk box ends within a cell of the surface.
  EXPECT_NEAR(half_width(cylinder({0, 0, 0}, {0, 1, 0}, 3)), 3, 3.0 / 32);
  EXPECT_NEAR(half_width(cone({0, 0, 0}, {0, 1, 0}, 3, 2)), 3, 3.0 / 32);
  EXPECT_NEAR(half_width(paraboloid({0, 0, 0}, {0, 1, 0}, 3, 2)), 3, 3.0 / 32);
  EXPECT_NEAR(half_width(hyperboloid_of_one_sheet({0, 0, 0}, {0, 1, 0}, 3, 2)), 3 * std::sqrt(2), 5.0 / 32);
  EXPECT_NEAR(half_width(hyperboloid_of_two_sheets({0, 0, 0}, {0, 1, 0}, 3, 1)), 3 * std::sqrt(3), 6.0 / 32);
  EXPECT_TRUE(std::isinf(FreeForm(cylinder({0, 0, 0}, {0, 1, 0}, 3)).bounds().max.y));
  EXPECT_EQ(FreeForm(cylinder({0, 0, 0}, {0, 1, 0}, 3)).bounds().max.x, 3);
  EXPECT_TRUE(joined(Join::intersect, sphere({0, 0, 0}, 1), sphere({3, 0, 0}, 1)).bounds().isEmpty());
}

TEST(FormBounds, ranges_close_in_on_the_value_as_boxes_shrink) {
  RandomForms forms(65);
  for (int n = 0; n < 200; ++n) {
    const FreeForm form = forms.form(2);
    const Vec3d p = forms.point(2);
    const double reach = 1e-5;
    const Interval range = form.range({p - Vec3d(reach), p + Vec3d(reach)});
    const Interval wide = form.range({p - Vec3d(100 * reach), p + Vec3d(100 * reach)});
    // A hundredth, were bounds linear and rounding nothing.
    EXPECT_LE(range.width(), wide.width() / 10 + 1e-9 * (1 + wide.magnitude())) << n;
  }
}

TEST(LocalForm, leaves_out_what_does_not_act_in_its_box) {
  const FreeForm form = perturbed(
      sphere({0, 0, 0}, 1),
      {{sphere({1, 0, 0}, 0.5), 0.8}, {sphere({-1, 0, 0}, 0.5), -0.8}, {sphere({0, 1, 0}, 0.5), 0.8}});
  EXPECT_EQ(form.within({Vec3d(-2), Vec3d(2)}).perturbations().size(), 3u);
  EXPECT_EQ(form.within({Vec3d(0.8, 0, 0), Vec3d(1, 0.1, 0.1)}).perturbations().size(), 1u);
  EXPECT_EQ(form.within({Vec3d(-0.1), Vec3d(0.1)}).perturbations().size(), 0u);
  EXPECT_EQ(form.within({Vec3d(-0.1), Vec3d(0.1)}).program().nodes.size(), 1u);

  const FreeForm pair = joined(Join::unite, sphere({-2, 0, 0}, 1), sphere({2, 0, 0}, 1));
  EXPECT_EQ(pair.within({Vec3d(1, -1, -1), Vec3d(3, 1, 1)}).program().nodes.size(), 2u)
      << "the first sphere is still there, but leads nowhere";
  EXPECT_EQ(pair.within({Vec3d(-3, -1, -1), Vec3d(-1, 1, 1)}).program().nodes.size(), 1u);
}

}  // namespace
}  // namespace pileus
