#include "lib/noise/fbm.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/fixtures/slow_tests.h"
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

constexpr OctaveSum kKinds[] = {OctaveSum::fbm, OctaveSum::billow, OctaveSum::ridged};

TEST(Fbm, gradients_agree_with_differences) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> coordinate(-50, 50);
  for (int n = 0; n < 300; ++n) {
    FbmParams params{.octaves = 3, .frequency = 0.5};
    if (n % 2) params.warp = 0.7;
    if (n % 3) params.evolution = 0.4;
    const Fbm fbm(params);
    const Vec3d p(coordinate(random), coordinate(random), coordinate(random));
    const OctaveSum kind = kKinds[n % 3];
    const NoiseSample sample = fbm.sample(kind, p);
    for (int axis = 0; axis < 3; ++axis) {
      Vec3d before = p, after = p;
      before[axis] -= 1e-6, after[axis] += 1e-6;
      const double near = fbm.value(kind, before), far = fbm.value(kind, after);
      const double difference = (far - near) / (after[axis] - before[axis]);
      // A crease between the two points would show: that is rarer than one in 1e4.
      ASSERT_NEAR(sample.gradient[axis], difference, 1e-4) << p << " kind " << int(kind) << " axis " << axis;
    }
  }
}

TEST(Fbm, tiles) {
  const Fbm fbm({.octaves = 4, .frequency = 0.25, .lacunarity = 2, .tile = Vec3i(3, 0, 5), .warp = 0.5});
  for (const Vec3d& p : {Vec3d(0.5, 3, 0.25), Vec3d(11.75, -2, 19), Vec3d(-7, 100, 1e4)}) {
    for (const OctaveSum kind : kKinds) {
      EXPECT_NEAR(fbm.value(kind, p), fbm.value(kind, p + Vec3d(12, 0, -40)), 1e-12);
    }
  }
}

TEST(Fbm, says_what_does_not_tile) {
  std::vector<std::string> problems;
  FbmParams{.octaves = 4, .lacunarity = 1.5, .tile = Vec3i(8, 0, 16)}.check(problems);
  EXPECT_TRUE(problems.empty());
  FbmParams{.octaves = 4, .lacunarity = 1.5, .tile = Vec3i(8, 0, 4)}.check(problems);
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems[0].substr(0, 46), "a tile of 4 cells along z has 13.5 cells in oc");
}

TEST(Fbm, evolution_loops) {
  FbmParams params{.octaves = 5};
  const Vec3d p(0.3, 0.6, -4.2);
  const double still = Fbm(params).value(OctaveSum::fbm, p);
  params.evolution = 2;
  EXPECT_NEAR(Fbm(params).value(OctaveSum::fbm, p), still, 1e-12);
  params.evolution = 0.1;
  EXPECT_NE(Fbm(params).value(OctaveSum::fbm, p), still);
}

TEST(Fbm, warp_reads_the_noise_elsewhere) {
  const FbmParams plain{.octaves = 1, .frequency = 0.5};
  FbmParams warped = plain;
  warped.warp = 0.8;
  // The three ways are noise of the same frequency, shifted by 37, 53 and 71 octaves' shifts.
  const reference::SlowPerlin slow;
  const Vec3d shift(0.8191725133961645, 0.6710436067037893, 0.5497004779019703), p(3.7, -9.1, 4.4);
  Vec3d q = p;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3d at = 0.5 * p + shift * std::array<double, 3>{37, 53, 71}[size_t(axis)];
    q[axis] += 0.8 / 0.5 * slow.value(at.x, at.y, at.z);
  }
  EXPECT_NEAR(Fbm(warped).value(OctaveSum::fbm, p), Fbm(plain).value(OctaveSum::fbm, q), 1e-12);
}

/// Hostile on purpose: many octaves, gains up to 1, warps, tiles, far places.
FbmParams random_params(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  FbmParams params{.octaves = 1 + int(random() % 9),
                   .frequency = std::exp2(12 * unit(random) - 8),
                   .lacunarity = 1 + 3 * unit(random),
                   .gain = 0.05 + 0.95 * unit(random),
                   .seed = int(random() % 4)};
  if (random() % 4 == 0) params.lacunarity = 2, params.tile = Vec3i(int(random() % 9), int(random() % 3), 7);
  if (random() % 3 == 0) params.evolution = 3 * unit(random) - 1;
  if (random() % 4 == 0) params.warp = 2 * unit(random);
  return params;
}

TEST(Fbm, bounds_hold_the_values_in_a_box) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  const int boxes = wants_slow_tests() ? 8000 : 150;  // of 129 points for each kind
  for (int n = 0; n < boxes; ++n) {
    const FbmParams params = random_params(random);
    const Fbm fbm(params);
    const double reach = (n % 4 ? 30 : 1e5) / params.frequency;
    const Vec3d low(reach * (unit(random) - 0.5), reach * (unit(random) - 0.5), reach * unit(random));
    const double size = std::exp2(-9 * unit(random) + 1) / params.frequency;
    const Box3d box(low, low + Vec3d(size, size, 4.0 / 3.0 * size));
    const NoiseBlock block{.origin = low, .spacing = size / 3, .count = Vec3i(4, 4, 5)};
    std::vector<float> values(block.size());
    std::vector<Vec3d> points{box.max};
    while (points.size() < 49) {
      Vec3d p;
      for (int axis = 0; axis < 3; ++axis) {
        const double t = unit(random);
        p[axis] = t < 0.2   ? box.min[axis]
                  : t < 0.4 ? std::nextafter(box.max[axis], -1e300)
                            : box.min[axis] + unit(random) * (box.max[axis] - box.min[axis]);
        p[axis] = std::min(p[axis], box.max[axis]);
      }
      points.push_back(p);
    }
    std::vector<float> point_values(points.size());
    for (const OctaveSum kind : kKinds) {
      const Interval bound = fbm.bound(kind, box, 1 + n % 5);
      fbm.evaluate(kind, block, values);
      for (const float value : values)
        ASSERT_TRUE(bound.contains(double(value))) << n << " kind " << int(kind);
      fbm.evaluate(kind, points, point_values);
      for (size_t i = 0; i < points.size(); ++i) {
        ASSERT_TRUE(bound.contains(double(point_values[i]))) << n << " kind " << int(kind);
        ASSERT_TRUE(bound.contains(fbm.value(kind, points[i]))) << n << " kind " << int(kind);
      }
    }
  }
}

TEST(Fbm, bounds_of_many_cubes_are_those_of_each) {
  for (const double warp : {0.0, 0.3}) {
    const Fbm fbm({.octaves = 4, .frequency = 0.3, .warp = warp});
    const NoiseBlock cubes{.origin = Vec3d(-4, 2, 1e4), .spacing = 0.2, .count = Vec3i(5, 3, 9)};
    std::vector<Interval> bounds(cubes.size());
    for (const OctaveSum kind : kKinds) {
      fbm.bound(kind, cubes, bounds);
      for (size_t n = 0; n < bounds.size(); ++n) {
        const Vec3d at(double(n / 27), double(n / 9 % 3), double(n % 9));
        const Vec3d low = cubes.origin + cubes.spacing * at;
        const Interval one = fbm.bound(kind, Box3d(low, low + Vec3d(cubes.spacing)), 1);
        ASSERT_NEAR(bounds[n].lo, one.lo, 1e-5);
        ASSERT_NEAR(bounds[n].hi, one.hi, 1e-5);
        ASSERT_LT(one.width(), 1.5) << "tells nothing";
      }
    }
  }
}

TEST(Fbm, octaves_do_not_vanish_together) {
  EXPECT_GT(Fbm(FbmParams{}).value(OctaveSum::billow, Vec3d(0.0)), 0.0);
}

}  // namespace
}  // namespace pileus
