#include <numbers>

#include "lib/math/henyey_greenstein.h"
#include "tests/hard_cases/hard_cases.h"

namespace pileus::hard_cases {
namespace {

/// The integral over the sphere of a function of 1 - cos (the first argument) and 1 + cos: Simpson's rule in
/// the logarithm of the distance from either pole, which resolves a peak of any width.
template <class Function>
double integrate_over_sphere(Function function) {
  constexpr int kIntervals = 4000;
  constexpr double kLogLeast = -46.0;  // 1e-20 of the range
  double sum = 0.0;
  for (const bool is_forward : {true, false}) {
    for (int i = 0; i <= kIntervals; ++i) {
      const double weight = i == 0 || i == kIntervals ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
      const double x =
          std::exp(kLogLeast * (1.0 - double(i) / kIntervals));  // distance from the pole, up to 1
      sum += weight * x * (is_forward ? function(x, 2.0 - x) : function(2.0 - x, x));
    }
  }
  return 2.0 * std::numbers::pi * sum * -kLogLeast / kIntervals / 3.0;
}

}  // namespace

void add_phase_checks(Checks& checks) {
  checks.add({"PHS-01", "PHS-02", "PHS-03", "PHS-04", "PHS-05", "PHS-06", "PHS-07", "PHS-08", "PHS-09"},
             []<class T>(T, const HardCase& row) {
               const T x = row.input<T>("one_minus_cos");
               expect_values<T>(row, {henyey_greenstein(row.input<T>("g"), x, 2 - x)});
             });
  checks.add({"PHS-10"}, []<class T>(T, const HardCase& row) {
    const T x = row.input<T>("one_plus_cos");
    expect_values<T>(row, {henyey_greenstein(row.input<T>("g"), 2 - x, x)});
  });
  checks.add({"PHS-11", "PHS-12", "PHS-13", "PHS-14", "PHS-15", "PHS-16", "PHS-17", "PHS-18"},
             []<class T>(T, const HardCase& row) {
               const auto angle = sample_henyey_greenstein(row.input<T>("g"), row.input<T>("xi"));
               expect_values<T>(row, {angle.one_minus_cos, angle.one_plus_cos});
             });
  checks.add({"PHS-19"}, []<class T>(T, const HardCase& row) {
    std::vector<T> integrals;
    for (const T g : row.inputs<T>("g")) {
      integrals.push_back(T(integrate_over_sphere(
          [&](double minus, double plus) { return henyey_greenstein(g, T(minus), T(plus)); })));
    }
    expect_values<T>(row, integrals);
  });
  checks.add({"PHS-20"}, []<class T>(T, const HardCase& row) {
    // The misprint (1 - l)^2 for 1 - l^2, as a factor on the true function, and not what ours integrates to.
    const double l = row.input<double>("l");
    const double misprint = (1.0 - l) / (1.0 + l);
    const auto hg = [l](double minus, double plus) { return henyey_greenstein(l, minus, plus); };
    EXPECT_NEAR(4.0 * std::numbers::pi * misprint * integrate_over_sphere(hg), row.expected<T>()[0], 1e-9);
    EXPECT_GT(integrate_over_sphere(hg), 2.0 * misprint);
  });
}

}  // namespace pileus::hard_cases
