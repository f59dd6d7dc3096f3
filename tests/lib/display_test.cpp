#include "lib/image/display.h"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/image/image_io.h"
#include "tests/fixtures/file_size_limit.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Image grey_image(int width, int height, std::vector<float> values) {
  Image image{width, height, {}, {}};
  for (const char* name : {"R", "G", "B"}) image.add(name).values = values;
  return image;
}

TEST(Display, srgb_curve_has_its_published_values) {
  EXPECT_EQ(srgb_from_linear(0.0), 0.0);
  EXPECT_NEAR(srgb_from_linear(1.0), 1.0, 1e-15);
  EXPECT_NEAR(srgb_from_linear(0.18), 0.461356, 1e-6);  // photographic middle grey
  EXPECT_NEAR(srgb_from_linear(0.5), 0.735357, 1e-6);
  EXPECT_NEAR(srgb_from_linear(0.001), 0.01292, 1e-15);  // the straight part
  for (double v = -0.5; v <= 2.0; v += 0.01) EXPECT_NEAR(srgb_from_linear(linear_from_srgb(v)), v, 1e-7);
}

TEST(Display, exposure_doubles_and_values_are_clamped) {
  EXPECT_DOUBLE_EQ(display_value({.exposure_stops = 1}, 0.25), srgb_from_linear(0.5));
  EXPECT_DOUBLE_EQ(display_value({.exposure_stops = -2}, 1.0), srgb_from_linear(0.25));
  EXPECT_DOUBLE_EQ(display_value({}, 7.0), srgb_from_linear(1.0));
  EXPECT_EQ(display_value({}, -7.0), 0.0);
  EXPECT_TRUE(std::isnan(display_value({}, kNaN)));
  EXPECT_DOUBLE_EQ(display_value({.curve = DisplayCurve::gamma, .gamma = 2.0}, 0.25), 0.5);
}

TEST(Display, steps_are_the_rounded_display_values) {
  std::vector<float> radiances;
  for (int i = -100; i < 4900; ++i) radiances.push_back(float(i) / 4000.0f);
  const Image image = grey_image(50, 100, radiances);
  for (const DisplayTransform& transform :
       {DisplayTransform{}, DisplayTransform{.exposure_stops = 1.3},
        DisplayTransform{.exposure_stops = -0.7, .curve = DisplayCurve::gamma, .gamma = 1.8}}) {
    const DisplayImage picture = to_display(image, transform);
    EXPECT_EQ(picture.non_finite.count, 0u);
    for (size_t i = 0; i < radiances.size(); ++i) {
      EXPECT_EQ(picture.rgb[3 * i], uint8_t(255.0 * display_value(transform, radiances[i]) + 0.5))
          << radiances[i];
    }
  }
}

TEST(Display, pixels_that_are_not_finite_are_magenta_counted_and_located) {
  Image image = grey_image(3, 2, std::vector<float>(6, 0.0f));
  image.channels[1].values[2] = kNaN;
  image.channels[2].values[4] = -kInfinity;
  image.add("Z").values.assign(6, kInfinity);  // no colour: an empty background is infinitely far
  const DisplayImage picture = to_display(image, {});
  EXPECT_EQ(picture.non_finite.count, 2u);
  EXPECT_EQ(picture.non_finite.first, Vec2i(2, 0));
  const std::vector<uint8_t> expected{0, 0, 0, 0,   0, 0,   255, 0, 255,  //
                                      0, 0, 0, 255, 0, 255, 0,   0, 0};
  EXPECT_EQ(picture.rgb, expected);
}

TEST(Display, a_grey_picture_shows_and_one_without_colours_is_refused) {
  Image grey{1, 1, {}, {}};
  grey.add("Y").values = {1.0f};
  EXPECT_EQ(to_display(grey, {}).rgb, (std::vector<uint8_t>{255, 255, 255}));
  Image depth{1, 1, {}, {}};
  depth.add("Z");
  EXPECT_THROW(to_display(depth, {}), Error);
}

TEST(Display, png_keeps_every_step_and_reports_what_is_not_finite) {
  const TempFolder folder;
  std::vector<float> values(256);
  for (size_t i = 0; i < values.size(); ++i) values[i] = float(linear_from_srgb(double(i) / 255.0));
  Image image = grey_image(16, 16, values);
  EXPECT_EQ(write_png(folder / "a.png", image).count, 0u);
  const Image back = read_image(folder / "a.png");
  ASSERT_EQ(back.channels.size(), 3u);  // opaque
  for (size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(back.channels[0].values[i], values[i], 1e-6);
  image.channels[0].values[17] = kNaN;
  const NonFinitePixels bad = write_png(folder / "a.png", image);
  EXPECT_EQ(bad.count, 1u);
  EXPECT_EQ(bad.first, Vec2i(1, 1));
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(Display, png_names_its_gamma_so_that_reading_undoes_it) {
  const TempFolder folder;
  const Image image = grey_image(1, 1, {0.25f});
  write_png(folder / "a.png", image, {.curve = DisplayCurve::gamma, .gamma = 2.0});
  EXPECT_NEAR(read_image(folder / "a.png").channels[0].values[0], 0.25f, 0.003);
}

TEST(Display, a_full_disk_is_an_error_and_leaves_the_old_png) {
  const TempFolder folder;
  std::vector<float> values(size_t(90) * 90);
  for (size_t i = 0; i < values.size(); ++i) values[i] = float((i * i) % 257) / 257.0f;
  const Image image = grey_image(90, 90, values);
  write_png(folder / "a.png", image);
  const auto whole_bytes = std::filesystem::file_size(folder / "a.png");
  for (const auto allowed : {rlim_t(0), rlim_t(100), rlim_t(whole_bytes / 2), rlim_t(whole_bytes - 1)}) {
    const FileSizeLimit limit(allowed);
    EXPECT_THROW(write_png(folder / "a.png", image), Error) << allowed << " bytes allowed";
  }
  EXPECT_EQ(folder.file_count(), 1u);
  EXPECT_EQ(std::filesystem::file_size(folder / "a.png"), whole_bytes);
}

}  // namespace
}  // namespace pileus
