#include <cmath>

#include "lib/freeform/form_program.h"
#include "lib/freeform/form_tracer.h"
#include "lib/freeform/free_form.h"
#include "lib/freeform/join.h"
#include "lib/freeform/shapes.h"
#include "lib/math/segments.h"
#include "tests/hard_cases/hard_cases.h"

// Free forms know double precision only (single precision is for many points at once): the inputs are rounded
// to the precision under test, the work is done in double.

namespace pileus::hard_cases {
namespace {

/// 1 - x², for rays along x.
Quadric slab(const Vec3d& center = Vec3d(0.0)) {
  return plane_pair(center, {1, 0, 0}, 2);
}

/// 1 - 4 |p - center|²
Quadric bump(const Vec3d& center) {
  return sphere(center, 0.5);
}

/// a x² + c
Quadric parabola(double a, double c) {
  return Quadric(Frame(), {a, 0, 0, 0, 0, 0, 0, 0, 0, c});
}

/// Where a ray along x through (0, y, 0) enters or leaves the form, from -5 to 5.
std::vector<double> crossings(const FreeForm& form, double y = 0.0) {
  std::vector<double> result;
  for (const Segment& part : inside(form, {{-5, y, 0}, {1, 0, 0}}, {0, 10})) {
    if (part.t0 > 0) result.push_back(part.t0 - 5);
    if (part.t1 < 10) result.push_back(part.t1 - 5);
  }
  return result;
}

void expect_near(const std::vector<double>& got, const std::vector<long double>& expected, double tolerance) {
  ASSERT_EQ(got.size(), expected.size());
  for (size_t i = 0; i < got.size(); ++i) EXPECT_NEAR(got[i], double(expected[i]), tolerance) << i;
}

/// F = 1 - x² - y², Q = 1 - x² - (y - 2)²: the ray y = 2 sees -3 - x² + f (1 - x²)³.
FreeForm tangent(double factor) {
  return perturbed(cylinder({0, 0, 0}, {0, 0, 1}, 1), {{cylinder({0, 2, 0}, {0, 0, 1}, 1), factor}});
}

FreeForm bumped(double factor, const Vec3d& center = Vec3d(0.0)) {
  return perturbed(slab(center), {{bump(center + Vec3d(1, 0, 0)), factor}});
}

Segments segments(const nlohmann::json& list) {
  Segments result;
  for (const auto& pair : list) result.push_back({pair.at(0).get<double>(), pair.at(1).get<double>()});
  return result;
}

void expect_segments(const Segments& got, const nlohmann::json& expected) {
  const Segments wanted = segments(expected);
  ASSERT_EQ(got.size(), wanted.size());
  for (size_t i = 0; i < got.size(); ++i) {
    EXPECT_EQ(got[i].t0, wanted[i].t0);
    EXPECT_EQ(got[i].t1, wanted[i].t1);
  }
}

}  // namespace

void add_forms_checks(Checks& checks) {
  checks.add({"PRT-01", "PRT-02"}, []<class T>(T, const HardCase& row) {
    const std::vector<double> found = crossings(bumped(double(row.input<T>("f"))));
    ASSERT_EQ(found.size(), 2u);
    expect_values<T>(row, std::vector<T>{T(found[1])});
  });
  checks.add({"PRT-03"}, []<class T>(T, const HardCase& row) {
    const FreeForm form = perturbed(slab(), {{bump({3, 0, 0}), double(row.input<T>("f"))}});
    const std::vector<double> found = crossings(form);
    expect_values<T>(row, std::vector<T>(found.begin(), found.end()));
  });
  checks.add({"PRT-04"}, []<class T>(T, const HardCase& row) {
    const std::vector<double> found = crossings(tangent(double(row.input<T>("f"))), 2);
    EXPECT_EQ(found.size() % 2, 0u);
    for (const double x : found) EXPECT_NEAR(x, 0.0, double(row.tolerance<T>(0)));
  });
  checks.add({"PRT-05", "PRT-06"}, []<class T>(T, const HardCase& row) {
    expect_near(crossings(tangent(double(row.input<T>("f"))), 2), row.expected_list("roots"),
                double(row.tolerance<T>(0)));
  });
  checks.add({"PRT-07"}, []<class T>(T, const HardCase& row) {
    const FreeForm form =
        perturbed(parabola(63, -94.0 / 3), {{parabola(1, 0), 17.0 / 3}, {parabola(1, 1), -14.0 / 3}});
    expect_near(crossings(form), row.expected<T>(), double(row.tolerance<T>(0)));
  });
  checks.add({"PRT-08"}, []<class T>(T, const HardCase& row) {
    const Quadric q = bump({1, 0, 0});
    const FreeForm form = perturbed(parabola(0, 0), {{q, 0.8}});
    const double tolerance = double(row.tolerance<T>(0)), step = 1e-4;
    const double second = form.gradient({0.5 + step, 0, 0}).x / step;
    EXPECT_NEAR(form.value({0.5, 0, 0}), double(row.expected("R")), tolerance);
    EXPECT_NEAR(form.gradient({0.5, 0, 0}).x, double(row.expected("R_x")), tolerance);
    EXPECT_NEAR(second, double(row.expected("R_xx")), 200 * step) << "falls with the step";
    EXPECT_EQ(form.gradient({0.5 - step, 0, 0}).x, 0.0);
    EXPECT_NEAR(2 * second / step, double(row.expected("jump_R_xxx")), 2000 * step);
    EXPECT_NEAR(6 * 0.8 * std::pow(q.gradient({0.5, 0, 0}).x, 3), double(row.expected("jump_R_xxx")),
                tolerance);
  });
  checks.add({"PRT-09"}, []<class T>(T, const HardCase& row) {
    const FreeForm form = perturbed(sphere({0, 0, 0}, 1), {{bump({1, 0, 0}), double(row.input<T>("f"))}});
    const Vec3d normal = -normalize(form.gradient({1.2, 0.1, 0}));
    expect_near({normal.x, normal.y, normal.z}, row.expected<T>(), double(row.tolerance<T>(0)));
  });
  checks.add({"PRT-10"}, []<class T>(T, const HardCase& row) {
    const Vec3d far(1e6, -2e6, 3e6);
    const Segments found = inside(bumped(0.8, far), {far + Vec3d(3, 0, 0), {-1, 0, 0}}, {0, 10});
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].t0, double(row.expected("t")), 1e-9);
  });
  checks.add({"PRT-11"}, []<class T>(T, const HardCase& row) {
    const FreeForm form = perturbed(slab(), {{bump({1.5, 0, 0}), 100}});
    expect_near(crossings(form), row.expected<T>(), double(row.tolerance<T>(0)));
  });
  checks.add({"PRT-12"}, []<class T>(T, const HardCase& row) {
    const FreeForm form = perturbed(sphere({0, 0, 0}, 1), {{bump({1, 1, 1}), 0.8}});
    const double upper = double(row.expected("true_max")), lower = double(row.expected("true_min"));
    double last = 0.0;
    for (double half = 0.1; half > 0.001; half /= 2) {
      const Interval range = form.range({Vec3d(1 - half), Vec3d(1 + half)});
      if (half == 0.1) {
        EXPECT_GE(range.hi, upper);
        EXPECT_LE(range.lo, lower);
      } else {
        EXPECT_LE(range.width(), 0.6 * last) << "linear at least";
      }
      last = range.width();
    }
  });

  checks.add({"SET-01", "SET-02", "SET-03"}, []<class T>(T, const HardCase& row) {
    const Blend rvachev{.alpha = 0.0};
    expect_values<T>(row, std::vector<T>{intersection(row.input<T>("a"), row.input<T>("b"), rvachev)});
  });
  checks.add({"SET-04", "SET-05"}, []<class T>(T, const HardCase& row) {
    const nlohmann::json &inputs = row.row.at("inputs"), &expected = row.row.at("expected");
    const Segments a = segments(inputs.at("A")), b = segments(inputs.at("B"));
    expect_segments(unite(a, b), expected.at("union"));
    expect_segments(intersect(a, b), expected.at("intersection"));
    expect_segments(subtract(a, b), expected.at("A_minus_B"));
    if (expected.contains("xor")) expect_segments(unite(subtract(a, b), subtract(b, a)), expected.at("xor"));
  });
  checks.add({"SET-06"}, []<class T>(T, const HardCase& row) {
    // The catalogue's 4 - r² is four times the ball of radius 2.
    const FreeForm small = sphere({0, 0, 0}, 1), large = Quadric(Frame(), {.a44 = 4.0});
    const std::vector<double> found = crossings(morphed(large, small, double(row.input<T>("beta"))));
    ASSERT_EQ(found.size(), 2u);
    expect_values<T>(row, std::vector<T>{T(found[1])});
  });
  checks.add({"SET-07"}, []<class T>(T, const HardCase& row) {
    const FreeForm first = parabola(0, -5), second = parabola(0, 3);
    const FreeForm moving = morphed(second, first, {{0.0, 0.25}, {1.0, 0.75}});
    const Interval range = range_over_time(moving, {Vec3d(-1), Vec3d(1)}, 0.0, 1.0);
    EXPECT_NEAR(range.hi, double(row.expected<T>()[0]), 1e-12);
    EXPECT_GE(range.hi, double(row.expected<T>()[0]));
  });
}

}  // namespace pileus::hard_cases
