#include "lib/texture/color_stops.h"

#include <gtest/gtest.h>

namespace pileus {
namespace {

const ColorStops kStops({{1, Rgb(0.2, 0, 1)}, {3, Rgb(0.6, 1, 0)}, {3.5, Rgb(0, 0, 0)}});

/// The mean by many samples.
Rgb slow_mean(const ColorStops& stops, const Interval& x) {
  constexpr int kSamples = 20000;
  Rgb sum(0.0);
  for (int i = 0; i < kSamples; ++i) sum += stops.at(x.lo + x.width() * (i + 0.5) / kSamples);
  return sum / double(kSamples);
}

TEST(ColorStops, are_linear_between_and_constant_beyond) {
  EXPECT_EQ(kStops.at(-9), Rgb(0.2, 0, 1));
  EXPECT_EQ(kStops.at(1), Rgb(0.2, 0, 1));
  EXPECT_LT((kStops.at(2) - Rgb(0.4, 0.5, 0.5)).length(), 1e-15);
  EXPECT_EQ(kStops.at(3), Rgb(0.6, 1, 0));
  EXPECT_EQ(kStops.at(99), Rgb(0, 0, 0));
}

TEST(ColorStops, have_exact_means) {
  for (const double middle : {-4.0, 0.9, 1.0, 2.0, 3.1, 3.5, 7.0}) {
    for (const double width : {0.0, 1e-12, 1e-5, 0.1, 1.0, 3.0, 50.0}) {
      const Interval x{middle - 0.5 * width, middle + 0.5 * width};
      EXPECT_LT((kStops.mean(x) - slow_mean(kStops, x)).length(), 2e-6) << middle << " " << width;
    }
  }
  EXPECT_EQ(kStops.mean({1e9, 1e9 + 2}), Rgb(0, 0, 0));
  EXPECT_EQ(ColorStops({{2, Rgb(0.5)}}).mean({0, 9}), Rgb(0.5));
}

TEST(ColorStops, must_rise) {
  std::vector<std::string> problems;
  kStops.check(problems);
  EXPECT_TRUE(problems.empty());
  ColorStops({{1, Rgb(0)}, {1, Rgb(1)}}).check(problems);
  ColorStops().check(problems);
  ASSERT_EQ(problems.size(), 2u);
  EXPECT_EQ(problems[0], "stops: 1 comes after 1; expected rising values of \"at\"");
  EXPECT_EQ(problems[1], "stops is empty; expected one stop or more");
}

}  // namespace
}  // namespace pileus
