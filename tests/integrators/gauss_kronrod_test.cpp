#include "lib/math/gauss_kronrod.h"

#include <cmath>

#include <gtest/gtest.h>

namespace pileus {
namespace {

double kronrod(int degree) {
  double sum = 0.0;
  for (const auto& node : GaussKronrod7::kNodes) sum += node.kronrod * std::pow(node.x, degree);
  return sum;
}

double gauss(int degree) {
  double sum = 0.0;
  for (const auto& node : GaussKronrod7::kNodes) sum += node.gauss * std::pow(node.x, degree);
  return sum;
}

TEST(GaussKronrod7, integrates_polynomials_up_to_its_degree) {
  for (int degree = 0; degree <= 11; ++degree)
    EXPECT_NEAR(kronrod(degree), 1.0 / (degree + 1), 4e-16) << degree;
  for (int degree = 0; degree <= 5; ++degree) EXPECT_NEAR(gauss(degree), 1.0 / (degree + 1), 4e-16) << degree;
}

TEST(GaussKronrod7, is_no_better_than_its_degree) {
  EXPECT_GT(std::abs(kronrod(12) - 1.0 / 13.0), 1e-10);
  EXPECT_GT(std::abs(gauss(6) - 1.0 / 7.0), 1e-5);
}

}  // namespace
}  // namespace pileus
