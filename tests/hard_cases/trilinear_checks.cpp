#include <array>
#include <numbers>

#include "lib/math/compositor.h"
#include "lib/math/trilinear.h"
#include "tests/hard_cases/hard_cases.h"

namespace pileus::hard_cases {
namespace {

template <class T>
using Vec = Imath::Vec3<T>;

template <class T>
std::array<T, 8> corners(const HardCase& row) {
  std::array<T, 8> result;
  const char* names[] = {"c000", "c100", "c010", "c110", "c001", "c101", "c011", "c111"};
  for (size_t i = 0; i < 8; ++i) result[i] = row.input<T>(names[i]);
  return result;
}

template <class T>
T mean_density(const std::array<T, 8>& corners, const Vec<T>& p, const Vec<T>& q) {
  return bernstein_mean(trilinear_bernstein(corners, p, q));
}

}  // namespace

void add_trilinear_checks(Checks& checks) {
  checks.add({"TRI-01"}, []<class T>(T, const HardCase& row) {
    const Vec<T> p(T(0), T(0.25), T(0.375)), q(T(1), T(0.75), T(0.875));
    expect_values<T>(row, {(q - p).length() * mean_density(corners<T>(row), p, q)});
  });
  checks.add({"TRI-02"}, []<class T>(T, const HardCase& row) {
    expect_values<T>(row, {std::numbers::sqrt3_v<T> * mean_density(corners<T>(row), Vec<T>(0), Vec<T>(1))});
  });
  checks.add({"TRI-03"}, []<class T>(T, const HardCase& row) {
    const T edge = std::ldexp(T(1), -20);
    const T length = edge * std::numbers::sqrt3_v<T>;  // never from a difference of positions
    expect_values<T>(row, {length * mean_density(corners<T>(row), Vec<T>(T(0.25)), Vec<T>(T(0.25) + edge))});
  });
  checks.add({"TRI-04"}, []<class T>(T, const HardCase& row) {
    const std::array<T, 8> one_corner{0, 0, 0, 0, 0, 0, 0, row.input<T>("c")};
    expect_values<T>(row, {std::numbers::sqrt3_v<T> * mean_density(one_corner, Vec<T>(0), Vec<T>(1))});
  });

  checks.add({"TRI-06", "TRI-07", "TRI-08", "TRI-09", "TRI-10"}, []<class T>(T, const HardCase& row) {
    const SourceWeights<T> weights = source_weights(row.input<T>("tau"));
    expect_values<T>(row, {weights.front, weights.back});
  });
  checks.add({"TRI-11"}, []<class T>(T, const HardCase& row) {
    Compositor<T> compositor;
    compositor.add_gradient(row.input<T>("tau"), Vec<T>(1), Vec<T>(3));
    expect_values<T>(row, {compositor.radiance().x});
  });
  checks.add({"TRI-12"}, []<class T>(T, const HardCase& row) {
    expect_values<T>(row, {source_weights(row.input<T>("a") * row.input<T>("d")).back});
  });
  checks.add({"TRI-14"}, []<class T>(T, const HardCase& row) {
    const T e = row.input<T>("e"), T_in = row.input<T>("T_in");
    const T bound = e * T_in;
    expect_values<T>(row, {bound});
    // A dark layer in front leaves T_in; then a segment with a source of 0 or 1, over the opposite
    // background.
    const auto colour = [&](T tau, T source, T background) {
      Compositor<T> compositor;
      compositor.add_segment(-std::log(T_in), Vec<T>(0));
      compositor.add_segment(tau, Vec<T>(source));
      return compositor.over(Vec<T>(background)).x;
    };
    const T slack = 4 * std::numeric_limits<T>::epsilon();
    for (const T tau : {T(0), T(1e-6), T(0.1), T(1), T(20)}) {
      EXPECT_LE(std::abs(colour(tau + e, 1, 0) - colour(tau, 1, 0)), bound + slack);
      EXPECT_LE(std::abs(colour(tau + e, 0, 1) - colour(tau, 0, 1)), bound + slack);
    }
  });
}

}  // namespace pileus::hard_cases
