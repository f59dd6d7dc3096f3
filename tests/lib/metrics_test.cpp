#include "lib/image/metrics.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/image/difference_image.h"
#include "lib/image/display.h"
#include "lib/image/ssim.h"
#include "tests/reference/image_metrics.h"

namespace pileus {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Image image_of(int width, int height, std::vector<std::pair<const char*, std::vector<float>>> channels) {
  Image image{width, height, {}, {}};
  for (auto& [name, values] : channels) image.add(name).values = std::move(values);
  return image;
}

Image grey(int width, int height, float value) {
  const std::vector<float> values(size_t(width) * size_t(height), value);
  return image_of(width, height, {{"R", values}, {"G", values}, {"B", values}});
}

Image noise(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  Image image{width, height, {}, {}};
  for (const char* name : {"R", "G", "B"}) {
    for (float& value : image.add(name).values) value = float(random() % 1000) / 900.0f;
  }
  return image;
}

/// A small picture with edges, ramps and all hues, as display values; `changed` alters a square of it.
RgbPlanes pattern(bool changed) {
  RgbPlanes planes{Plane(48, 32), Plane(48, 32), Plane(48, 32)};
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 48; ++x) {
      const bool inside = changed && x >= 20 && x < 30 && y >= 10 && y < 20;
      const float r = float(x % 16) / 15.0f, g = float(y % 8) / 7.0f;
      const float b = (x / 4 + y / 4) % 2 ? 1.0f : 0.0f;
      planes[0].row(y)[size_t(x)] = linear_from_srgb(inside ? 1 - r : r);
      planes[1].row(y)[size_t(x)] = linear_from_srgb(g);
      planes[2].row(y)[size_t(x)] = linear_from_srgb(inside ? 0.5f : b);
    }
  }
  return planes;
}

TEST(Metrics, are_those_computed_by_hand) {
  const Image x = image_of(2, 1, {{"Y", {0.5f, 1.0f}}}), r = image_of(2, 1, {{"Y", {0.25f, 2.0f}}});
  const ImageDifference d = compare_images(x, r);
  EXPECT_EQ(d.channels, std::vector<std::string>{"Y"});
  EXPECT_DOUBLE_EQ(d.rmse, std::sqrt((0.0625 + 1.0) / 2));
  EXPECT_DOUBLE_EQ(d.mae, 0.625);
  EXPECT_DOUBLE_EQ(d.max_abs, 1.0);
  EXPECT_DOUBLE_EQ(d.bias, (0.25 - 1.0) / 2);
  EXPECT_DOUBLE_EQ(d.rel_mse, (0.0625 / 0.0725 + 1.0 / 4.01) / 2);
  EXPECT_DOUBLE_EQ(d.quantile_999, 1.0);
  // As display values, the second pixel is 1 in both pictures.
  const double difference = srgb_from_linear(0.5) - srgb_from_linear(0.25);
  EXPECT_NEAR(d.psnr, -10 * std::log10(difference * difference / 2), 1e-12);
}

TEST(Metrics, quantile_leaves_out_one_value_in_a_thousand) {
  Image x = grey(100, 10, 0.0f), r = grey(100, 10, 0.0f);  // 3000 values
  for (int i = 0; i < 3; ++i) x.channels[0].values[size_t(i)] = 5.0f;
  EXPECT_EQ(compare_images(x, r).quantile_999, 0.0);
  x.channels[1].values[7] = 3.0f;
  EXPECT_EQ(compare_images(x, r).quantile_999, 3.0);
}

TEST(Metrics, equal_pictures_do_not_differ) {
  const Image image = noise(23, 17, 5);
  const ImageDifference d = compare_images(image, image);
  for (const double error : {d.rmse, d.mae, d.max_abs, d.bias, d.rel_mse, d.quantile_999, d.flip}) {
    EXPECT_EQ(error, 0.0);
  }
  EXPECT_DOUBLE_EQ(d.ssim, 1.0);
  EXPECT_EQ(d.psnr, std::numeric_limits<double>::infinity());
  EXPECT_EQ(d.nan_pixels, 0u);
}

TEST(Metrics, pixels_that_cannot_be_compared_are_counted_and_left_out) {
  Image x = grey(4, 2, 0.5f), r = grey(4, 2, 0.25f);
  x.channels[0].values[0] = kNaN;
  x.channels[1].values[0] = kInfinity;  // the same pixel again
  r.channels[2].values[1] = kNaN;
  x.channels[1].values[2] = kInfinity;  // shared by neither
  x.channels[0].values[3] = r.channels[0].values[3] = -kInfinity;
  const ImageDifference d = compare_images(x, r);
  EXPECT_EQ(d.nan_pixels, 3u);
  EXPECT_EQ(d.max_abs, 0.25);
  EXPECT_DOUBLE_EQ(d.mae, 0.25 * 14 / 15);  // five pixels left, one value of them infinite in both
  for (const double value : {d.rmse, d.rel_mse, d.psnr, d.ssim, d.flip}) EXPECT_TRUE(std::isfinite(value));
}

TEST(Metrics, are_nan_where_nothing_is_left) {
  const ImageDifference d = compare_images(grey(3, 3, kNaN), grey(3, 3, 1.0f));
  EXPECT_EQ(d.nan_pixels, 9u);
  for (const Metric& metric : all_metrics()) {
    EXPECT_EQ(std::isnan(metric.value(d)), metric.name != "nan_pixels") << metric.name;
  }
}

TEST(Metrics, huge_values_do_not_overflow) {
  const float huge = std::numeric_limits<float>::max();
  const ImageDifference d = compare_images(grey(2, 2, huge), grey(2, 2, -huge));
  EXPECT_DOUBLE_EQ(d.rmse, 2.0 * double(huge));
  EXPECT_NEAR(d.rel_mse, 4.0, 1e-12);
}

TEST(Metrics, one_channel_can_be_asked_for) {
  const Image x = image_of(1, 1, {{"R", {1}}, {"G", {1}}, {"B", {1}}, {"Z", {7}}});
  const Image r = image_of(1, 1, {{"Z", {4}}, {"Y", {1}}});
  EXPECT_EQ(compare_images(x, r, {.channel = "Z"}).rmse, 3.0);
  EXPECT_THROW(compare_images(x, r), Error);  // no colours in common
  try {
    compare_images(x, r, {.channel = "ZZ"});
    ADD_FAILURE() << "a channel that is not there was compared";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_STREQ(error.what(),
                 "error: the first picture has no channel \"ZZ\"; found R, G, B, Z; nearest: Z");
  }
}

TEST(Metrics, sizes_must_match) {
  EXPECT_THROW(compare_images(grey(2, 3, 0), grey(3, 2, 0)), Error);
}

TEST(Metrics, do_not_depend_on_threads) {
  const Image x = noise(70, 50, 1), r = noise(70, 50, 2);
  ImageDifference one, seven;
  with_threads(1, [&] { one = compare_images(x, r); });
  with_threads(7, [&] { seven = compare_images(x, r); });
  for (const Metric& metric : all_metrics()) EXPECT_EQ(metric.value(one), metric.value(seven)) << metric.name;
}

TEST(Ssim, constant_planes_follow_the_luminance_term) {
  Plane x(30, 12), r(30, 12);
  x.values.assign(x.values.size(), 0.6);
  r.values.assign(r.values.size(), 0.3);
  const double expected = (2 * 0.6 * 0.3 + 1e-4) / (0.36 + 0.09 + 1e-4);
  EXPECT_NEAR(ssim(x, r), expected, 1e-12);
}

TEST(Ssim, is_its_definition_window_by_window) {
  for (const auto& [width, height] : {std::pair{31, 23}, {4, 3}, {1, 1}, {40, 1}}) {
    std::mt19937 random(9);
    Plane x(width, height), r(width, height);
    for (double& value : x.values) value = double(random() % 1000) / 999.0;
    for (double& value : r.values) value = double(random() % 1000) / 999.0;
    EXPECT_NEAR(ssim(x, r), reference::ssim(x, r), 1e-12) << width << " x " << height;
  }
}

TEST(Flip, black_and_white_follow_from_the_papers_formulas) {
  RgbPlanes black{Plane(8, 6), Plane(8, 6), Plane(8, 6)}, white = black;
  for (Plane& plane : white) plane.values.assign(plane.values.size(), 1.0);
  // No blur changes a constant picture and none has features. The distance is that of L* alone, 100^0.7;
  // green and blue, in L*a*b* (87.735, -86.183, 83.180) and (32.299, 79.191, -107.865), are the farthest
  // apart.
  const double a = 0.87735 * -86.183 - 0.32299 * 79.191, b = 0.87735 * 83.180 + 0.32299 * 107.865;
  const double largest = std::pow(87.735 - 32.299 + std::hypot(a, b), 0.7);
  const double expected = 0.95 + 0.05 * (std::pow(100.0, 0.7) - 0.4 * largest) / (0.6 * largest);
  const Plane map = flip_map(white, black);
  for (const double value : map.values) EXPECT_NEAR(value, expected, 1e-5);
  EXPECT_NEAR(expected, 0.96738, 1e-5);
}

TEST(Flip, green_and_blue_are_the_farthest_apart) {
  RgbPlanes green{Plane(5, 5), Plane(5, 5), Plane(5, 5)}, blue = green;
  green[1].values.assign(25, 1.0);
  blue[2].values.assign(25, 1.0);
  EXPECT_NEAR(mean(flip_map(green, blue)), 1.0, 1e-12);
}

TEST(Flip, agrees_with_the_authors_program) {
  // Version 1.6 of the program that the authors of the paper publish gives 0.0673083 in single precision.
  EXPECT_NEAR(mean(flip_map(pattern(true), pattern(false))), 0.0673083, 1e-6);
}

TEST(Flip, is_its_definition_with_two_dimensional_kernels) {
  for (const double pixels_per_degree : {20.0, kDefaultPixelsPerDegree}) {
    const Plane got = flip_map(pattern(true), pattern(false), pixels_per_degree);
    const Plane expected = reference::flip_map(pattern(true), pattern(false), pixels_per_degree);
    for (size_t i = 0; i < got.values.size(); ++i) EXPECT_NEAR(got.values[i], expected.values[i], 1e-9);
  }
}

TEST(Flip, is_symmetric_and_stays_in_its_range) {
  const Plane ab = flip_map(pattern(true), pattern(false)), ba = flip_map(pattern(false), pattern(true));
  for (size_t i = 0; i < ab.values.size(); ++i) {
    EXPECT_EQ(ab.values[i], ba.values[i]);
    EXPECT_GE(ab.values[i], 0.0);
    EXPECT_LE(ab.values[i], 1.0);
  }
}

TEST(DifferenceImage, is_blue_below_white_at_and_red_above_zero) {
  const Image x = image_of(5, 1, {{"Y", {1.0f, 1.5f, 0.75f, 9.0f, kNaN}}});
  const Image r = image_of(5, 1, {{"Y", {1.0f, 1.0f, 1.0f, 1.0f, 1.0f}}});
  const Image picture = difference_image(x, r, 0.5);
  const std::vector<uint8_t> expected{255, 255, 255,  // equal
                                      255, 0,   0,    // + scale
                                      128, 128, 255,  // - scale / 2
                                      255, 0,   0,    // beyond
                                      255, 0,   255};
  EXPECT_EQ(to_display(picture, {}).rgb, expected);
  EXPECT_EQ(std::get<double>(picture.metadata.at("difference_scale")), 0.5);
}

TEST(DifferenceImage, shows_the_channel_that_differs_most) {
  const Image x = image_of(1, 1, {{"R", {0.1f}}, {"G", {-0.3f}}, {"B", {0.2f}}});
  const DisplayImage picture = to_display(difference_image(x, grey(1, 1, 0.0f), 0.3), {});
  EXPECT_EQ(picture.rgb, (std::vector<uint8_t>{0, 0, 255}));
}

}  // namespace
}  // namespace pileus
