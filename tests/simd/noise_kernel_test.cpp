// Noise in blocks, on every instruction set, against the double-precision sums.
#include <cmath>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lib/noise/fbm.h"
#include "tests/fixtures/simd_targets.h"

namespace pileus {
namespace {

constexpr OctaveSum kKinds[] = {OctaveSum::fbm, OctaveSum::billow, OctaveSum::ridged};

std::vector<Vec3d> points_of(const NoiseBlock& block) {
  std::vector<Vec3d> points;
  for (int i = 0; i < block.count.x; ++i) {
    for (int j = 0; j < block.count.y; ++j) {
      for (int k = 0; k < block.count.z; ++k) points.push_back(block.origin + block.spacing * Vec3d(i, j, k));
    }
  }
  return points;
}

/// Sum of amplitude * frequency, which gradients and what they may be off grow with.
double steepness(const FbmParams& params) {
  double sum = 0, total = 0;
  for (int i = 0; i < params.octaves; ++i) {
    total += std::pow(params.gain, i);
    sum += std::pow(params.gain * params.lacunarity, i) * params.frequency;
  }
  return sum / total;
}

/// Compares a block, with and without gradients, and the same points one by one with sample(), on every
/// instruction set. Gradients of billows and ridges only where no octave is near a crease: there their side
/// is open.
void expect_equal(const FbmParams& params, const NoiseBlock& block) {
  const Fbm fbm(params);
  const std::vector<Vec3d> points = points_of(block);
  const double slope_error = kNoiseFloatSlopeError * steepness(params);
  for (const OctaveSum kind : kKinds) {
    std::vector<NoiseSample> expected;
    for (const Vec3d& p : points) expected.push_back(fbm.sample(kind, p));
    for_each_simd_target([&](const std::string& target) {
      const auto check = [&](const std::vector<float>& got, const char* how) {
        EXPECT_EQ(got.back(), -7.0f) << target << how;
        for (size_t n = 0; n < expected.size(); ++n) {
          ASSERT_NEAR(got[n], expected[n].value, kNoiseFloatError)
              << target << how << ", kind " << int(kind) << ", point " << n << " of " << block.count << " at "
              << points[n];
        }
      };
      const auto check_gradients = [&](const std::vector<Vec3f>& got, const char* how) {
        for (size_t n = 0; n < expected.size(); ++n) {
          if (kind != OctaveSum::fbm && (params.octaves > 1 || std::fabs(expected[n].value) < 1e-5)) continue;
          if (kind == OctaveSum::ridged && expected[n].value > 0.9999) continue;
          for (int axis = 0; axis < 3; ++axis) {
            ASSERT_NEAR(got[n][axis], expected[n].gradient[axis], slope_error)
                << target << how << ", kind " << int(kind) << ", point " << n << " of " << block.count;
          }
        }
      };
      const std::vector<float> untouched(points.size() + 1, -7.0f);
      std::vector<Vec3f> gradients(points.size());
      std::vector<float> got = untouched;
      fbm.evaluate(kind, block, std::span(got).first(points.size()));
      check(got, ", block");
      got = untouched;
      fbm.evaluate(kind, block, std::span(got).first(points.size()), gradients);
      check(got, ", block with gradients");
      check_gradients(gradients, ", block");
      got = untouched;
      fbm.evaluate(kind, points, std::span(got).first(points.size()));
      check(got, ", points");
      got = untouched;
      fbm.evaluate(kind, points, std::span(got).first(points.size()), gradients);
      check(got, ", points with gradients");
      check_gradients(gradients, ", points");
    });
  }
}

TEST(NoiseBlock, agrees_with_double_for_all_shapes) {
  const FbmParams fbm{.octaves = 3, .frequency = 0.7, .lacunarity = 2.1, .gain = 0.6, .seed = 3};
  for (const Vec3i& count :
       {Vec3i(8, 8, 8), Vec3i(1, 1, 1), Vec3i(1, 1, 130), Vec3i(1, 77, 1), Vec3i(65, 1, 1), Vec3i(9, 17, 3),
        Vec3i(3, 5, 1), Vec3i(11, 1, 9), Vec3i(1, 2, 67), Vec3i(2, 9, 1)}) {
    expect_equal(fbm, {.origin = Vec3d(-3.3, 0.2, 254.1), .spacing = 0.11, .count = count});
  }
}

TEST(NoiseBlock, agrees_with_double_for_all_spacings) {
  const FbmParams fbm{.octaves = 1, .frequency = 1, .seed = 1};
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
  const FbmParams fbm{.octaves = 6, .frequency = 3.0, .lacunarity = 2.0, .gain = 0.5, .seed = 3};
  for (int n = 0; n < 10; ++n) {
    const Vec3d origin(coordinate(random), coordinate(random), coordinate(random));
    expect_equal(fbm, {.origin = origin, .spacing = 0.0123, .count = Vec3i(8, 8, 8)});
  }
}

TEST(NoiseBlock, random_parameters) {
  std::mt19937_64 random(10);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto pick = [&](double low, double high) { return low + (high - low) * unit(random); };
  for (int n = 0; n < 40; ++n) {
    FbmParams fbm{.octaves = 1 + int(random() % 8),
                  .frequency = std::exp2(pick(-10, 3)),
                  .lacunarity = pick(1, 4),
                  .gain = pick(0.1, 1),
                  .seed = int(random() % 3)};
    if (n % 4 == 0) fbm.lacunarity = 3, fbm.tile = Vec3i(int(random() % 400), 1, int(random() % 3));
    if (n % 3 == 0) fbm.evolution = pick(-2, 2);
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
    fbm.evaluate(OctaveSum::fbm, std::vector<Vec3d>(512, Vec3d(huge, 0.5, -huge)), got);
    for (const float value : got) ASSERT_LE(std::fabs(value), float(kPerlinBound));
  }
}

TEST(NoiseBlock, warped_points_are_close) {
  const Fbm fbm({.octaves = 5, .frequency = 0.3, .warp = 0.7});
  const NoiseBlock block{.origin = Vec3d(-40, 3, 1e5), .spacing = 0.1, .count = Vec3i(8, 8, 8)};
  const std::vector<Vec3d> points = points_of(block);
  for (const OctaveSum kind : kKinds) {
    for_each_simd_target([&](const std::string& target) {
      std::vector<float> in_block(512), at_points(512);
      std::vector<Vec3f> gradients(512);
      fbm.evaluate(kind, block, in_block);
      fbm.evaluate(kind, points, at_points, gradients);
      for (size_t n = 0; n < points.size(); ++n) {
        const NoiseSample expected = fbm.sample(kind, points[n]);
        ASSERT_NEAR(in_block[n], expected.value, 2e-5) << target;
        ASSERT_NEAR(at_points[n], expected.value, 2e-5) << target;
        if (kind == OctaveSum::fbm) {
          ASSERT_LT(length(Vec3d(gradients[n]) - expected.gradient), 1e-4) << target;
        }
      }
    });
  }
}

}  // namespace
}  // namespace pileus
