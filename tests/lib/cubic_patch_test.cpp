#include "lib/terrain/cubic_patch.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "lib/terrain/sign_changes.h"

namespace pileus {
namespace {

HeightTable random_table(int columns, int rows, std::mt19937& random, double holes) {
  HeightTable table{columns, rows, {}};
  std::uniform_real_distribution<float> height(-2.0F, 3.0F);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  for (int k = 0; k < columns * rows; ++k)
    table.heights.push_back(chance(random) < holes ? std::nanf("") : height(random));
  return table;
}

/// The slow twin in one dimension: Catmull-Rom's spline as Hermite's, from heights and central differences.
long double hermite(long double p0, long double p1, long double p2, long double p3, long double s) {
  const long double m1 = (p2 - p0) / 2, m2 = (p3 - p1) / 2;
  return (2 * s * s * s - 3 * s * s + 1) * p1 + (s * s * s - 2 * s * s + s) * m1 +
         (3 * s * s - 2 * s * s * s) * p2 + (s * s * s - s * s) * m2;
}

TEST(CubicPatch, agrees_with_a_spline_of_splines) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const HeightTable table = random_table(12, 9, random, 0.0);
  for (int k = 0; k < 5000; ++k) {
    const int i = 1 + int(random() % 9), j = 1 + int(random() % 6);
    const double s = unit(random), r = unit(random);
    long double rows[4];
    for (int n = 0; n < 4; ++n) {
      const auto z = [&](int column) { return (long double)(table.at(i + column, j + n - 1)); };
      rows[n] = hermite(z(-1), z(0), z(1), z(2), s);
    }
    const CubicPatch patch(table, i, j);
    ASSERT_NEAR(patch.at(s, r), double(hermite(rows[0], rows[1], rows[2], rows[3], r)), 1e-13);
    constexpr double kStep = 1e-6;
    if (s < kStep || r < kStep || s > 1.0 - kStep || r > 1.0 - kStep) continue;
    const auto slope = patch.slope(s, r);
    ASSERT_NEAR(slope[0], (patch.at(s + kStep, r) - patch.at(s - kStep, r)) / (2.0 * kStep), 1e-7);
    ASSERT_NEAR(slope[1], (patch.at(s, r + kStep) - patch.at(s, r - kStep)) / (2.0 * kStep), 1e-7);
  }
}

TEST(CubicPatch, overshoots_by_an_eighth_between_equal_heights) {
  const HeightTable ridge{4, 4, {0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0}};
  EXPECT_EQ(CubicPatch(ridge, 1, 1).at(0.5, 0.3), 1.125);
}

TEST(CubicPatch, goes_on_straight_where_the_map_ends) {
  HeightTable slope{3, 3, {0, 1, 2, 2, 3, 4, 4, 5, 6}};
  for (const double s : {0.0, 0.25, 0.7, 1.0}) {
    for (const double r : {0.0, 0.4, 1.0}) EXPECT_NEAR(CubicPatch(slope, 0, 0).at(s, r), s + 2.0 * r, 1e-14);
  }
}

/// Bit for bit, at holes and ends of the map too: rays must not slip through between cells.
TEST(CubicPatch, agrees_with_its_neighbours_on_edges_and_in_nodes) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int compared = 0;
  for (const double holes : {0.0, 0.15}) {
    const HeightTable table = random_table(30, 24, random, holes);
    for (int k = 0; k < 20000; ++k) {
      const int i = int(random() % 28), j = int(random() % 22);
      const double x = k % 5 == 0 ? double(k % 2) : unit(random);
      const CubicPatch here(table, i, j), east(table, i + 1, j), south(table, i, j + 1);
      if (!here.has_data()) continue;
      ++compared;
      if (east.has_data()) {
        ASSERT_EQ(here.at(1.0, x), east.at(0.0, x));
      }
      if (south.has_data()) {
        ASSERT_EQ(here.at(x, 1.0), south.at(x, 0.0));
      }
      ASSERT_EQ(here.at(0.0, 0.0), double(table.at(i, j)));
    }
  }
  EXPECT_GT(compared, 20000);
}

TEST(CubicPatch, stays_within_its_bounds) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const HeightTable table = random_table(40, 40, random, 0.1);
  double tightest = 1.0;
  for (int k = 0; k < 4000; ++k) {
    const CubicPatch patch(table, int(random() % 39), int(random() % 39));
    const HeightRange range = cubic_range(patch);
    ASSERT_EQ(range.empty(), !patch.has_data());
    if (range.empty()) continue;
    for (int n = 0; n < 30; ++n) {
      const double z = patch.at(unit(random), unit(random));
      ASSERT_LE(z, range.greatest);
      ASSERT_GE(z, range.least);
      tightest = std::min(tightest, range.greatest - z);
    }
  }
  EXPECT_LT(tightest, 0.02) << "no decoration";
}

TEST(CubicPatch, is_a_polynomial_along_a_line) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const HeightTable table = random_table(20, 20, random, 0.0);
  for (int k = 0; k < 2000; ++k) {
    const CubicPatch patch(table, int(random() % 19), int(random() % 19));
    const double s0 = unit(random), r0 = unit(random), s1 = unit(random), r1 = unit(random),
                 at = unit(random);
    std::array<double, 7> g = along_line(patch.control(), s0, r0, s1, r1);
    for (size_t n = 6; n > 0; --n) {
      for (size_t m = 0; m < n; ++m) g[m] = lerp(g[m], g[m + 1], at);
    }
    ASSERT_NEAR(g[0], patch.at(lerp(s0, s1, at), lerp(r0, r1, at)), 1e-13);
  }
}

/// Bernstein coefficients of the product of (s - root) and constants, times a factor.
std::array<double, 7> with_roots(const std::vector<double>& roots, double factor) {
  std::array<long double, 7> powers{factor};
  for (const double root : roots) {
    for (size_t k = powers.size() - 1; k > 0; --k) powers[k] = powers[k - 1] - root * powers[k];
    powers[0] *= -root;
  }
  constexpr double kBinomial[7] = {1, 6, 15, 20, 15, 6, 1};
  const auto choose = [](int n, int k) {
    double value = 1.0;
    for (int m = 0; m < k; ++m) value = value * (n - m) / (m + 1);
    return value;
  };
  std::array<double, 7> result{};
  for (int k = 0; k < 7; ++k) {
    long double sum = 0.0L;
    for (int m = 0; m <= k; ++m) sum += powers[size_t(m)] * choose(k, m) / kBinomial[m];
    result[size_t(k)] = double(sum);
  }
  return result;
}

TEST(SignChanges, finds_all_roots_of_degree_six) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(-0.5, 1.5);
  int found = 0;
  for (int k = 0; k < 20000; ++k) {
    std::vector<double> roots;
    for (int n = 0; n < k % 7; ++n) roots.push_back(place(random));
    std::sort(roots.begin(), roots.end());
    bool is_close = false;
    for (size_t n = 1; n < roots.size(); ++n) is_close |= roots[n] - roots[n - 1] < 0.02;
    if (is_close) continue;
    const SignChanges changes = sign_changes(with_roots(roots, k % 2 == 0 ? 1.0 : -1.0));
    std::erase_if(roots, [](double root) { return root < 0.0 || root > 1.0; });
    ASSERT_EQ(size_t(changes.count), roots.size()) << k;
    for (size_t n = 0; n < roots.size(); ++n) ASSERT_NEAR(changes.s[n], roots[n], 1e-7);
    found += changes.count;
  }
  EXPECT_GT(found, 10000);
}

TEST(SignChanges, there_is_one_between_ends_of_different_sign) {
  std::mt19937 random(13);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int k = 0; k < 20000; ++k) {
    std::array<double, 7> g;
    for (double& value : g) value = std::pow(10.0, 12.0 * unit(random)) * (unit(random) > 0.0 ? 1.0 : -1.0);
    if (k % 3 == 0) g[size_t(k) % 7] = 0.0;
    const bool differ = (g[0] > 0.0) != (g[6] > 0.0);
    const SignChanges changes = sign_changes(g);
    ASSERT_EQ(changes.count % 2 == 1, differ) << k;
    for (int n = 0; n < changes.count; ++n)
      ASSERT_TRUE(changes.s[size_t(n)] >= 0.0 && changes.s[size_t(n)] <= 1.0);
  }
}

}  // namespace
}  // namespace pileus
