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
  EXPECT_DOUBLE_EQ(fbm.value(p), PerlinNoise().value(p * 2.5));
  EXPECT_DOUBLE_EQ(fbm.billow(p), std::fabs(PerlinNoise().value(p * 2.5)));
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
    ASSERT_NEAR(fbm.value(p), sum / 1.75, 1e-13);
    ASSERT_NEAR(fbm.billow(p), billows / 1.75, 1e-13);
  }
}

TEST(Fbm, keeps_the_bound_of_one_octave) {
  const Fbm fbm({.octaves = 16, .frequency = 1.0, .lacunarity = 2, .gain = 1.0, .seed = 4});
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> coordinate(-1e4, 1e4);
  for (int n = 0; n < 20000; ++n) {
    const Vec3d p(coordinate(random), coordinate(random), coordinate(random));
    ASSERT_LE(std::fabs(fbm.value(p)), kPerlinBound);
    ASSERT_GE(fbm.billow(p), 0.0);
    ASSERT_LE(fbm.billow(p), kPerlinBound);
  }
}

TEST(Fbm, octaves_do_not_vanish_together) {
  EXPECT_GT(Fbm(FbmParams{}).billow(Vec3d(0.0)), 0.0);
}

}  // namespace
}  // namespace pileus
