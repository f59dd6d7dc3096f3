// Free forms at many points, on every instruction set, against one point at a time in double.
#include "lib/freeform/kernels/form_kernel.h"

#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lib/freeform/form_tracer.h"
#include "tests/fixtures/random_forms.h"
#include "tests/fixtures/simd_targets.h"

namespace pileus {
namespace {

TEST(FormKernel, there_are_several_targets) {
  std::set<std::string> names;
  for_each_simd_target([&](const std::string& name) {
    EXPECT_EQ(name, form_target());
    names.insert(name);
  });
  EXPECT_FALSE(names.empty());
}

TEST(FormKernel, agrees_with_double_within_its_range) {
  for_each_simd_target([&](const std::string& target) {
    RandomForms forms(81);
    for (int n = 0; n < 1000; ++n) {
      const FreeForm form = forms.form(forms.pick(4));
      PointLattice lattice;
      lattice.first = forms.point(2);
      lattice.step = Vec3d(forms.uniform(0, 0.02));
      lattice.count = {3, 5, 7};
      const LocalForm local = form.within(lattice.box());
      std::vector<float> f(lattice.size());
      local.values(lattice, f);
      if (!std::isfinite(local.range().hi)) continue;
      // What single precision may add to the range of double, on either side.
      const Interval exact = form.range(lattice.box());
      const double margin = std::max(local.range().hi - exact.hi, exact.lo - local.range().lo);
      for (int i = 0; i < 105; ++i) {
        const Vec3i at(i / 35, i / 7 % 5, i % 7);
        const double value = form.value(lattice.first + lattice.step * Vec3d(at));
        ASSERT_NEAR(double(f[size_t(i)]), value, std::max(0.0, margin) + 1e-30) << target << ", form " << n;
      }
    }
  });
}

/// Rays in lanes against one at a time.
TEST(CrossingKernel, finds_what_the_scalar_way_finds) {
  for_each_simd_target([&](const std::string& target) {
    RandomForms forms(82);
    int crossings = 0;
    for (int n = 0; n < 100; ++n) {
      std::vector<Perturbation> bumps;
      for (int k = 1 + forms.pick(6); k > 0; --k) {
        bumps.push_back({sphere(forms.point(1.2), forms.uniform(0.3, 0.8)), forms.uniform(-1, 1)});
      }
      const FreeForm form = perturbed(sphere({0, 0, 0}, 1), bumps);
      const FormTracer tracer(form);
      std::vector<Ray> rays;
      for (int i = 0; i < 1 + n % 70; ++i) {
        const Vec3d o = 4.0 * normalize(forms.direction());
        rays.push_back({o, normalize(forms.point(1.3) - o)});
      }
      const std::vector<Segment> segments(rays.size(), Segment{0, 20});
      std::vector<double> t(rays.size());
      tracer.first_crossings(rays, segments, t);
      for (size_t i = 0; i < rays.size(); ++i) {
        const std::optional<double> expected = tracer.first_crossing(rays[i], segments[i]);
        ASSERT_EQ(std::isfinite(t[i]), expected.has_value()) << target << ", form " << n << ", ray " << i;
        if (!expected) continue;
        const double steepness = std::fabs(dot(form.gradient(rays[i].at(*expected)), rays[i].d));
        ASSERT_NEAR(t[i], *expected, 1e-13 / steepness + 1e-15) << target << ", form " << n << ", ray " << i;
        ++crossings;
      }
    }
    EXPECT_GT(crossings, 1000) << target;
  });
}

TEST(FormKernel, every_number_of_points) {
  const FreeForm form = joined(Join::unite, sphere({0, 0, 0}, 1), sphere({1, 0, 0}, 1), {.smooth = 0.3});
  const LocalForm local = form.within({Vec3d(-1), Vec3d(1)});
  for_each_simd_target([&](const std::string& target) {
    for (size_t n = 0; n < 600; n = n < 40 ? n + 1 : n * 2 - 3) {
      std::vector<float> x(n), y(n), z(n), f(n + 1, -5.0f);
      for (size_t i = 0; i < n; ++i) x[i] = -1.0f + 2.0f * float(i) / float(n), y[i] = 0.1f, z[i] = -0.3f;
      local.values(x, y, z, std::span(f).first(n));
      for (size_t i = 0; i < n; ++i) {
        ASSERT_NEAR(double(f[i]), form.value(Vec3d(double(x[i]), double(y[i]), double(z[i]))), 1e-5)
            << target;
      }
      ASSERT_EQ(f[n], -5.0f) << target;
    }
  });
}

}  // namespace
}  // namespace pileus
