#include "lib/noise/fbm.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/reference/perlin_reference.h"

namespace pileus {
namespace {

TEST(Fbm, one_octave_is_the_noise_itself) {
  const Fbm fbm({.octaves = 1, .frequency = 2.5, .lacunarity = 3, .gain = 0.1, .seed = 0});
  const Vec3d p(0.31, -0.7, 12.2);
  EXPECT_DOUBLE_EQ(fbm.value(OctaveSum::fbm, p), PerlinNoise().value(p * 2.5));
  EXPECT_DOUBLE_EQ(fbm.value(OctaveSum::billow, p), std::fabs(PerlinNoise().value(p * 2.5)));
}

TEST(Fbm, agrees_with_the_definition) {
  const Fbm fbm({.octaves = 3, .frequency = 0.5, .lacunarity = 2.25, .gain = 0.5, .seed = 0});
  const reference::SlowPerlin slow;
  const double shift[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> coordinate(-50, 50);
  for (int n = 0; n < 2000; ++n) {
    const Vec3d p(coordinate(random), coordinate(random), coordinate(random));
    double sum = 0.0, billows = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double frequency = 0.5 * std::pow(2.25, i);
      const double octave = slow.value(p.x * frequency + i * shift[0], p.y * frequency + i * shift[1],
                                       p.z * frequency + i * shift[2]);
      sum += std::pow(0.5, i) * octave;
      billows += std::pow(0.5, i) * std::fabs(octave);
    }
    ASSERT_NEAR(fbm.value(OctaveSum::fbm, p), sum / 1.75, 1e-13);
    ASSERT_NEAR(fbm.value(OctaveSum::billow, p), billows / 1.75, 1e-13);
  }
}

TEST(Fbm, keeps_the_bound_of_one_octave) {
  const Fbm fbm({.octaves = 16, .frequency = 1.0, .lacunarity = 2, .gain = 1.0, .seed = 4});
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> coordinate(-1e4, 1e4);
  for (int n = 0; n < 20000; ++n) {
    const Vec3d p(coordinate(random), coordinate(random), coordinate(random));
    ASSERT_LE(std::fabs(fbm.value(OctaveSum::fbm, p)), kPerlinBound);
    ASSERT_GE(fbm.value(OctaveSum::billow, p), 0.0);
    ASSERT_LE(fbm.value(OctaveSum::billow, p), kPerlinBound);
  }
}

TEST(Fbm, bounds_hold_the_values_in_a_box) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> coordinate(-100, 100), unit(0, 1);
  for (int n = 0; n < 600; ++n) {
    const Fbm fbm({.octaves = 1 + n % 6, .frequency = 0.2, .lacunarity = 2, .gain = 0.5, .seed = n % 3});
    const Vec3d low(coordinate(random), coordinate(random), coordinate(random));
    const double size = std::exp2(-8 * unit(random) + 1);
    const Box3d box(low, low + Vec3d(size));
    NoiseBlock block{.origin = low, .spacing = size / 7, .count = Vec3i(8, 8, 8)};
    std::vector<float> values(block.size());
    for (const OctaveSum kind : {OctaveSum::fbm, OctaveSum::billow, OctaveSum::ridged}) {
      const Interval bound = fbm.bound(kind, box);
      fbm.evaluate(kind, block, values);
      for (const float value : values) ASSERT_TRUE(bound.contains(double(value))) << int(kind) << low << size;
      const Vec3d p = low + size * Vec3d(unit(random), unit(random), unit(random));
      ASSERT_TRUE(bound.contains(fbm.value(kind, p))) << int(kind) << low << size;
    }
  }
}

TEST(Fbm, octaves_do_not_vanish_together) {
  EXPECT_GT(Fbm(FbmParams{}).value(OctaveSum::billow, Vec3d(0.0)), 0.0);
}

}  // namespace
}  // namespace pileus
