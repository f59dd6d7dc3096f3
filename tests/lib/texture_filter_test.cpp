#include "lib/texture/texture_filter.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/fixtures/random_texels.h"
#include "tests/reference/texture_reference.h"

namespace pileus {
namespace {

const Wraps kRepeat{Wrap::repeat, Wrap::repeat};

TEST(SeenArea, is_a_disk_from_above_and_longer_at_a_slant) {
  const SurfaceArea above = seen_area({0, 1, 0}, {0, 1, 0}, 0.5);
  EXPECT_NEAR(length(above.a), 0.5, 1e-15);
  EXPECT_NEAR(length(above.b), 0.5, 1e-15);
  EXPECT_NEAR(dot(above.a, above.b), 0.0, 1e-15);
  const SurfaceArea slant = seen_area({0, 1, 0}, {0.6, 0.8, 0}, 0.5);
  EXPECT_NEAR(std::fabs(slant.a.x), 0.5 / 0.8, 1e-15) << "along the view";
  EXPECT_NEAR(std::fabs(slant.b.z), 0.5, 1e-15);
  const SurfaceArea grazing = seen_area({0, 1, 0}, {1, 0, 0}, 0.5);
  EXPECT_NEAR(length(grazing.a), 32.0, 1e-12);
}

TEST(TextureFilter, interpolates_the_picture_where_a_pixel_sees_less_than_a_texel) {
  const MipPyramid pyramid(random_texels(16, 16, 1));
  const Vec2d uv(0.317, 0.741);
  const Texel expected = pyramid.bilinear(0, uv, kRepeat);
  for (const TextureFilter filter : {TextureFilter::bilinear, TextureFilter::trilinear}) {
    EXPECT_EQ(filtered(pyramid, uv, {}, kRepeat, filter), expected);
    EXPECT_EQ(filtered(pyramid, uv, {{0.06, 0}, {0, 0.06}}, kRepeat, filter), expected);
  }
  EXPECT_EQ(filtered(pyramid, uv, {}, kRepeat, TextureFilter::nearest), pyramid.level(0).at(5, 11));
}

TEST(TextureFilter, reads_the_level_whose_texels_are_as_large_as_the_area) {
  const MipPyramid pyramid(random_texels(64, 64, 2));
  const Vec2d uv(0.317, 0.741);
  for (int level = 0; level <= 6; ++level) {
    const double width = std::exp2(level) / 64;
    const PictureArea area{{0, width}, {-width, 0}};
    for (const TextureFilter filter : {TextureFilter::bilinear, TextureFilter::trilinear}) {
      EXPECT_EQ(filtered(pyramid, uv, area, kRepeat, filter), pyramid.bilinear(level, uv, kRepeat));
    }
  }
}

/// A long and narrow area is averaged along its length only: stripes that run along it stay.
TEST(TextureFilter, keeps_what_runs_along_a_long_area) {
  TexelGrid stripes{64, 64, {}};
  for (int i = 0; i < 64 * 64; ++i) stripes.texels.emplace_back(i % 64 / 4 % 2 == 0 ? 1.0F : 0.0F);
  const MipPyramid pyramid(stripes);
  const PictureArea along{{1.0 / 64, 0}, {0, 14.0 / 64}}, across{{14.0 / 64, 0}, {0, 1.0 / 64}};
  const Vec2d white(2.0 / 64, 0.5);
  EXPECT_NEAR(filtered(pyramid, white, along, kRepeat, TextureFilter::trilinear).x, 1.0, 1e-6);
  EXPECT_NEAR(filtered(pyramid, white, across, kRepeat, TextureFilter::trilinear).x, 0.5, 0.1);
  EXPECT_LT(filtered(pyramid, white, along, kRepeat, TextureFilter::bilinear).x, 0.8);
}

/// Near the mean of the picture over the area, for smooth pictures.
TEST(TextureFilter, is_about_the_mean_of_the_area) {
  TexelGrid waves{128, 128, {}};
  for (int y = 0; y < 128; ++y) {
    for (int x = 0; x < 128; ++x) {
      waves.texels.emplace_back(
          float(0.5 + 0.25 * std::sin(2 * M_PI * x / 32) + 0.25 * std::cos(2 * M_PI * y / 64)));
    }
  }
  const MipPyramid pyramid(waves);
  for (const double wide : {1.0, 3.0, 8.0, 20.0}) {
    for (const double high : {1.0, 4.0, 9.0}) {
      const PictureArea area{{wide / 128, 0}, {0, high / 128}};
      const double x = 50, y = 60;
      const double mean =
          reference::box_mean(waves, x - wide / 2, x + wide / 2, y - high / 2, y + high / 2).x;
      const double got = filtered(pyramid, {x / 128, y / 128}, area, kRepeat, TextureFilter::trilinear).x;
      EXPECT_NEAR(got, mean, 0.06) << wide << " x " << high;
    }
  }
}

TEST(TextureFilter, survives_areas_of_any_size) {
  const MipPyramid pyramid(random_texels(8, 32, 3));
  for (const double size : {0.0, 1e-300, 1e-9, 1.0, 1e9, 1e300, double(INFINITY), double(NAN)}) {
    for (const PictureArea& area : {PictureArea{{size, 0}, {0, size}}, PictureArea{{size, size}, {0, 0}},
                                    PictureArea{{size, 0}, {size, 0}}}) {
      for (const TextureFilter filter :
           {TextureFilter::nearest, TextureFilter::bilinear, TextureFilter::trilinear}) {
        const Texel texel = filtered(pyramid, {0.2, 0.7}, area, kRepeat, filter);
        for (int c = 0; c < 4; ++c) EXPECT_TRUE(texel[c] >= 0 && texel[c] <= 1.00001F) << size;
      }
    }
  }
}

/// As an area grows, its colour changes little by little.
TEST(TextureFilter, changes_without_jumps_as_the_area_grows) {
  const MipPyramid pyramid(random_texels(64, 64, 4));
  const Vec2d uv(0.41, 0.63);
  float before = pyramid.bilinear(0, uv, kRepeat).x;
  for (double width = 0.5; width < 80; width *= 1.002) {
    const PictureArea area{{width / 64, 0}, {0, width / 64}};
    const float here = filtered(pyramid, uv, area, kRepeat, TextureFilter::trilinear).x;
    EXPECT_NEAR(here, before, 0.005) << width;
    before = here;
  }
}

}  // namespace
}  // namespace pileus
