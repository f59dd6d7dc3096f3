// Free forms along rays: bounds that are never left, stretches that begin and end where the sign changes.
#include "lib/freeform/form_on_ray.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

#include "lib/freeform/form_tracer.h"
#include "tests/fixtures/random_forms.h"

namespace pileus {
namespace {

int hunt(int rays) {
  const char* factor = std::getenv("PILEUS_HUNT");
  return factor ? rays * std::atoi(factor) : rays;
}

TEST(FormOnRay, no_form_leaves_its_range_along_a_ray) {
  RandomForms forms(71);
  for (int n = 0; n < hunt(3000); ++n) {
    const FreeForm form = forms.form(forms.pick(4));
    const Ray ray{forms.point(5), normalize(forms.direction())};
    const double start = forms.uniform(0, 8), length = std::pow(10.0, forms.uniform(-7, 1));
    const Segment segment{start, start + length};
    const RayRange range = range_on_ray(form, ray, segment);
    for (int i = 0; i < 20; ++i) {
      const double share = i < 2 ? double(i) : forms.uniform(0, 1), t = start + share * length;
      const Vec3d p = ray.at(t);
      // The point of the ray is rounded; the gradient says how far that may carry the value.
      const double slope = dot(form.gradient(p), ray.d), off = 1e-14 * form.gradient(p).length();
      ASSERT_LE(range.f.lo - off, form.value(p)) << "form " << n;
      ASSERT_GE(range.f.hi + off, form.value(p)) << "form " << n;
      const double slope_off = 1e-7 * (1 + std::fabs(slope));
      ASSERT_LE(range.slope.lo - slope_off, slope) << "form " << n;
      ASSERT_GE(range.slope.hi + slope_off, slope) << "form " << n;
    }
  }
}

TEST(FormOnRay, stretches_are_where_the_form_is_not_negative) {
  RandomForms forms(72);
  int stretches = 0;
  for (int n = 0; n < hunt(300); ++n) {
    const FreeForm form = forms.form(forms.pick(3));
    const Ray ray{forms.point(6), normalize(forms.direction())};
    const Segment whole{0, 12};
    const Segments found = inside(form, ray, whole);
    stretches += int(found.size());
    for (size_t i = 0; i < found.size(); ++i) {
      ASSERT_LT(found[i].t0, found[i].t1);
      if (i > 0) {
        ASSERT_LT(found[i - 1].t1, found[i].t0);
      }
    }
    for (int i = 0; i < 100; ++i) {
      const double t = forms.uniform(0, 12);
      const Vec3d p = ray.at(t);
      const double f = form.value(p);
      if (std::fabs(f) < 1e-9 * (1 + form.gradient(p).length())) continue;  // too near to an end to tell
      const bool is_told = std::any_of(found.begin(), found.end(),
                                       [&](const Segment& part) { return part.t0 <= t && t < part.t1; });
      ASSERT_EQ(is_told, f > 0) << "form " << n << ", t = " << t << ", f = " << f;
    }
  }
  EXPECT_GT(stretches, 50);
}

TEST(FormOnRay, ends_are_exact_far_from_the_origin) {
  const Vec3d far(1e6, -2e6, 3e6);
  const Segments found = inside(sphere(far, 1.0), {far + Vec3d(-3, 0, 0), {1, 0, 0}}, {0, 10});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].t0, 2.0, 1e-9);
  EXPECT_NEAR(found[0].t1, 4.0, 1e-9);
}

TEST(FormOnRay, a_ray_that_starts_inside_starts_with_a_stretch) {
  const Segments found = inside(sphere({0, 0, 0}, 1.0), {{0.5, 0, 0}, {1, 0, 0}}, {0, 10});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].t0, 0.0);
  EXPECT_NEAR(found[0].t1, 0.5, 1e-15);
}

}  // namespace
}  // namespace pileus
