// Noise in blocks, on every instruction set, against the double-precision sums.
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "lib/noise/fbm.h"
#include "tests/fixtures/simd_targets.h"

namespace pileus {
namespace {

constexpr OctaveSum kKinds[] = {OctaveSum::fbm, OctaveSum::billow, OctaveSum::ridged};

/// Compares a block with value(), point by point, on every instruction set.
void expect_equal(const Fbm& fbm, const NoiseBlock& block) {
  for (const OctaveSum kind : kKinds) {
    std::vector<double> expected;
    double reach = 0;
    for (int i = 0; i < block.count.x; ++i) {
      for (int j = 0; j < block.count.y; ++j) {
        for (int k = 0; k < block.count.z; ++k) {
          const Vec3d p = block.origin + block.spacing * Vec3d(i, j, k);
          reach = std::max({reach, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
          expected.push_back(fbm.value(kind, p));
        }
      }
    }
    for_each_simd_target([&](const std::string& target) {
      std::vector<float> got(block.size() + 1, -7.0f);
      fbm.evaluate(kind, block, std::span(got).first(block.size()));
      EXPECT_EQ(got.back(), -7.0f) << target;
      for (size_t n = 0; n < expected.size(); ++n) {
        ASSERT_NEAR(got[n], expected[n], kNoiseFloatError)
            << target << ", kind " << int(kind) << ", point " << n << " of " << block.count << " at "
            << block.origin;
      }
    });
  }
}

TEST(NoiseBlock, agrees_with_double_for_all_shapes) {
  const Fbm fbm({.octaves = 3, .frequency = 0.7, .lacunarity = 2.1, .gain = 0.6, .seed = 3});
  for (const Vec3i& count :
       {Vec3i(8, 8, 8), Vec3i(1, 1, 1), Vec3i(1, 1, 130), Vec3i(1, 77, 1), Vec3i(65, 1, 1), Vec3i(9, 17, 3),
        Vec3i(3, 5, 1), Vec3i(11, 1, 9), Vec3i(1, 2, 67), Vec3i(2, 9, 1)}) {
    expect_equal(fbm, {.origin = Vec3d(-3.3, 0.2, 254.1), .spacing = 0.11, .count = count});
  }
}

TEST(NoiseBlock, agrees_with_double_for_all_spacings) {
  const Fbm fbm({.octaves = 1, .frequency = 1, .seed = 1});
  for (const double spacing :
       {1e-9, 1e-3, 0.1, 0.3, 0.5, 0.7, 0.85, 0.99, 1.0, 1.01, 1.7, 2.0, 3.3, 31.7, 1e5}) {
    for (const double start : {0.0, -0.5, 255.9}) {
      expect_equal(
          fbm, {.origin = Vec3d(start, -start, 0.5 * start), .spacing = spacing, .count = Vec3i(8, 8, 8)});
    }
  }
}

TEST(NoiseBlock, agrees_with_double_far_from_the_origin) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> coordinate(-150e3, 150e3);
  const Fbm fbm({.octaves = 6, .frequency = 3.0, .lacunarity = 2.0, .gain = 0.5, .seed = 3});
  for (int n = 0; n < 10; ++n) {
    const Vec3d origin(coordinate(random), coordinate(random), coordinate(random));
    expect_equal(fbm, {.origin = origin, .spacing = 0.0123, .count = Vec3i(8, 8, 8)});
  }
}

TEST(NoiseBlock, random_parameters) {
  std::mt19937_64 random(10);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto pick = [&](double low, double high) { return low + (high - low) * unit(random); };
  for (int n = 0; n < 30; ++n) {
    const Fbm fbm({.octaves = 1 + int(random() % 8),
                   .frequency = std::exp2(pick(-10, 3)),
                   .lacunarity = pick(1, 4),
                   .gain = pick(0.1, 1),
                   .seed = int(random() % 3)});
    expect_equal(fbm,
                 {.origin = Vec3d(pick(-1e3, 1e3), pick(-1e3, 1e3), pick(-1e3, 1e3)),
                  .spacing = std::exp2(pick(-9, 1)),
                  .count = Vec3i(1 + int(random() % 10), 1 + int(random() % 10), 1 + int(random() % 70))});
  }
}

TEST(NoiseBlock, is_zero_on_the_lattice) {
  const Fbm fbm({.octaves = 1, .seed = 4});
  for_each_simd_target([&](const std::string& target) {
    std::vector<float> got(512);
    fbm.evaluate(OctaveSum::fbm, {.origin = Vec3d(-4, 250, 1e9), .spacing = 1, .count = Vec3i(8, 8, 8)}, got);
    for (const float value : got) ASSERT_EQ(value, 0.0f) << target;
  });
}

TEST(NoiseBlock, is_finite_at_every_finite_place) {
  const Fbm fbm(FbmParams{});
  for (const double huge : {4294967295.5, 9.3e18, 1e300, -1e300}) {
    std::vector<float> got(512);
    fbm.evaluate(OctaveSum::fbm, {.origin = Vec3d(huge, -huge, 0.5), .spacing = 0.1, .count = Vec3i(8, 8, 8)},
                 got);
    for (const float value : got) ASSERT_LE(std::fabs(value), float(kPerlinBound));
  }
}

}  // namespace
}  // namespace pileus
