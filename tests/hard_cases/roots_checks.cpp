#include <array>

#include "lib/freeform/form_tracer.h"
#include "lib/freeform/shapes.h"
#include "lib/math/roots.h"
#include "tests/hard_cases/hard_cases.h"

namespace pileus::hard_cases {
namespace {

template <class T>
using Vec = Imath::Vec3<T>;

template <class T>
std::vector<T> list(const Roots<T>& roots) {
  return {roots.begin(), roots.end()};
}

template <class T>
Roots<T> solve(const HardCase& row) {
  return quadratic_roots(row.input<T>("a"), row.input<T>("b"), row.input<T>("c"));
}

/// F = square.x x^2 + square.y y^2 + square.z z^2 + linear.p + constant
template <class T>
struct Quadric {
  Vec<T> square, linear;
  T constant;

  /// Roots of F(o + t d).
  Roots<T> hits(const Vec<T>& o, const Vec<T>& d) const {
    const T a = square.dot(d * d);
    const T b = 2 * square.dot(o * d) + linear.dot(d);
    const T c = square.dot(o * o) + linear.dot(o) + constant;
    return quadratic_roots(a, b, c);
  }
};

/// z² - x² - y²
pileus::Quadric cone_along_z() {
  return cone({0, 0, 0}, {0, 0, 1}, 1, 1);
}

template <class T>
Vec<T> vec(double x, double y, double z) {
  return Vec<T>(T(x), T(y), T(z));
}

}  // namespace

void add_roots_checks(Checks& checks) {
  checks.add({"ROO-01", "ROO-02", "ROO-03", "ROO-04", "ROO-05", "ROO-06", "ROO-07", "ROO-08", "ROO-09",
              "ROO-10", "ROO-11", "ROO-13"},
             []<class T>(T, const HardCase& row) { expect_values<T>(row, list(solve<T>(row))); });
  checks.add({"ROO-12"}, []<class T>(T, const HardCase& row) {
    EXPECT_EQ(solve<T>(row).count, 0);
    EXPECT_GE(row.input<T>("c"), T(0)) << "inside everywhere: the sign of c says so";
  });

  checks.add({"ROO-14", "ROO-15", "ROO-16", "ROO-17", "ROO-18", "ROO-19", "ROO-20"},
             []<class T>(T, const HardCase& row) {
               const Vec<T> o(row.input<T>("off"), 0, -row.input<T>("Z"));
               expect_values<T>(row, list(sphere_hits(o, vec<T>(0, 0, 1), row.input<T>("r"))));
             });
  checks.add({"ROO-21"}, []<class T>(T, const HardCase& row) {
    const T radius = row.input<T>("Re");
    const Vec<T> o(0, radius + row.input<T>("alt"), 0);
    const Vec<T> d(row.input<T>("dx"), row.input<T>("dy"), 0);
    expect_values<T>(row, list(sphere_hits(o, d, radius)));
  });
  checks.add({"ROO-22"}, []<class T>(T, const HardCase& row) {
    const Roots<T> hits = sphere_hits(vec<T>(0.5, 0, 0), vec<T>(1, 0, 0), T(1));
    const auto first = hits.first_in(T(0), std::numeric_limits<T>::infinity());
    ASSERT_TRUE(first.has_value());
    EXPECT_NEAR(*first, row.expected("first"), row.tolerance<T>(0));
    EXPECT_LT(hits.t[0], T(0)) << "the smaller root lies behind";
  });
  checks.add({"ROO-23"}, []<class T>(T, const HardCase& row) {
    const Roots<T> hits = sphere_hits(vec<T>(1, 0, 0), vec<T>(-1, 0, 0), T(1));
    ASSERT_EQ(hits.count, 2);
    EXPECT_EQ(hits.t[0], T(0)) << "exactly";
    EXPECT_NEAR(hits.t[1], row.expected_list("roots")[1], row.tolerance<T>(0));
  });

  checks.add({"ROO-24"}, []<class T>(T, const HardCase& row) {
    const Quadric<T> cylinder{vec<T>(-1, -1, 0), Vec<T>(0), 1};
    const std::vector<T> o = row.inputs<T>("o"), d = row.inputs<T>("d");
    EXPECT_EQ(cylinder.hits({o[0], o[1], o[2]}, {d[0], d[1], d[2]}).count, 0);
    const Ray ray{{double(o[0]), double(o[1]), double(o[2])}, {double(d[0]), double(d[1]), double(d[2])}};
    const Segments all = inside(pileus::cylinder({0, 0, 0}, {0, 0, 1}, 1), ray, {0, 100});
    ASSERT_EQ(all.size(), 1u) << "inside everywhere";
    EXPECT_EQ(all[0].t0, 0.0);
    EXPECT_EQ(all[0].t1, 100.0);
  });
  checks.add({"ROO-25"}, []<class T>(T, const HardCase& row) {
    // A double root that rounding may split or lose; whatever is found lies near it.
    const Quadric<T> cone{vec<T>(-1, -1, 1), Vec<T>(0), 0};
    for (const T t : cone.hits(vec<T>(0.6, 0, -2), vec<T>(-0.287347885566346, 0, 0.957826285221151))) {
      EXPECT_NEAR(t, row.expected_list("roots")[0], 1e-3);
    }
    // Inside before the apex and after it, with or without a gap.
    const Ray ray{{0.6, 0, -2}, {-0.287347885566346, 0, 0.957826285221151}};
    const Segments parts = inside(cone_along_z(), ray, {0, 10});
    ASSERT_TRUE(parts.size() == 1 || parts.size() == 2);
    EXPECT_EQ(parts.front().t0, 0.0);
    EXPECT_EQ(parts.back().t1, 10.0);
    if (parts.size() == 2) {
      for (const double t : {parts[0].t1, parts[1].t0})
        EXPECT_NEAR(t, double(row.expected_list("roots")[0]), 1e-3);
    }
  });
  checks.add({"ROO-26"}, []<class T>(T, const HardCase& row) {
    const Quadric<T> paraboloid{vec<T>(-1, -1, 0), vec<T>(0, 0, 1), 0};
    const Roots<T> hits = paraboloid.hits(vec<T>(1, 1, 10), vec<T>(0, 0, -1));
    ASSERT_EQ(hits.count, 1);
    EXPECT_NEAR(hits.t[0], row.expected_list("roots")[0], row.tolerance<T>(0));
    const Segments parts =
        inside(pileus::paraboloid({0, 0, 0}, {0, 0, 1}, 1, 1), {{1, 1, 10}, {0, 0, -1}}, {0, 100});
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_EQ(parts[0].t0, 0.0);
    EXPECT_NEAR(parts[0].t1, double(row.expected_list("roots")[0]), 1e-14);
  });
  checks.add({"ROO-27"}, []<class T>(T, const HardCase& row) {
    const T half_sqrt2 = parse<T>("0.70710678118654752");
    const Quadric<T> hyperboloid{vec<T>(-1, -1, 1), Vec<T>(0), 1};
    const Roots<T> hits = hyperboloid.hits(vec<T>(2, 0, 0), {half_sqrt2, 0, half_sqrt2});
    const auto first = hits.first_in(T(-1e6), T(1e6));
    ASSERT_TRUE(first.has_value());
    const long double expected = row.expected_list("roots_exact_asymptote")[0];
    EXPECT_NEAR(*first, expected, row.tolerance<T>(expected));
    const double s = double(half_sqrt2);
    const Ray ray{Vec3d(2, 0, 0) - 5.0 * Vec3d(s, 0, s), {s, 0, s}};
    const Segments parts = inside(hyperboloid_of_one_sheet({0, 0, 0}, {0, 0, 1}, 1, 1), ray, {0, 100});
    ASSERT_EQ(parts.size(), 1u) << "the second root lies beyond";
    EXPECT_EQ(parts[0].t0, 0.0);
    EXPECT_NEAR(parts[0].t1, 5 + double(expected), double(row.tolerance<T>(expected)));
  });
}

}  // namespace pileus::hard_cases
