#include "lib/texture/mip_pyramid.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/core/parallel.h"
#include "tests/fixtures/random_texels.h"
#include "tests/reference/texture_reference.h"

namespace pileus {
namespace {

constexpr Wrap kWraps[] = {Wrap::clamp, Wrap::repeat, Wrap::mirror};

void expect_near(const Texel& texel, const reference::Texel64& expected, double tolerance) {
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(double(texel[c]), expected[c], tolerance) << "channel " << c;
}

TEST(MipPyramid, texels_are_means_of_the_picture_where_sizes_are_powers_of_two) {
  const TexelGrid picture = random_texels(64, 16, 1);
  const MipPyramid pyramid(picture);
  ASSERT_EQ(pyramid.top(), 6);
  for (int level = 0; level <= pyramid.top(); ++level) {
    const TexelGrid& grid = pyramid.level(level);
    const double wide = 64.0 / grid.width, high = 16.0 / grid.height;
    for (int y = 0; y < grid.height; ++y) {
      for (int x = 0; x < grid.width; ++x) {
        expect_near(grid.at(x, y),
                    reference::box_mean(picture, x * wide, (x + 1) * wide, y * high, (y + 1) * high), 3e-7);
      }
    }
  }
}

TEST(MipPyramid, texels_are_means_of_the_level_before_at_any_size) {
  for (const auto& [width, height] : {std::pair(1, 1), {1, 9}, {37, 22}, {5, 1}, {3, 3}, {64, 33}}) {
    const MipPyramid pyramid(random_texels(width, height, 2));
    const TexelGrid& last = pyramid.level(pyramid.top());
    EXPECT_EQ(last.width * last.height, 1);
    for (int level = 1; level <= pyramid.top(); ++level) {
      const TexelGrid &fine = pyramid.level(level - 1), &grid = pyramid.level(level);
      EXPECT_EQ(grid.width, std::max(1, fine.width / 2));
      EXPECT_EQ(grid.height, std::max(1, fine.height / 2));
      const double wide = double(fine.width) / grid.width, high = double(fine.height) / grid.height;
      for (int y = 0; y < grid.height; ++y) {
        for (int x = 0; x < grid.width; ++x) {
          // Rounded up, an edge may lie a little beyond the picture.
          expect_near(grid.at(x, y),
                      reference::box_mean(fine, x * wide, std::min((x + 1) * wide, double(fine.width)),
                                          y * high, std::min((y + 1) * high, double(fine.height))),
                      2e-7);
        }
      }
    }
    expect_near(last.at(0, 0), reference::box_mean(pyramid.level(0), 0, width, 0, height), 1e-6);
  }
}

TEST(MipPyramid, keeps_a_colour_exactly) {
  const Texel color(1.0F, 0.3F, 0.7F, 1.0F);
  const MipPyramid pyramid(TexelGrid{41, 23, std::vector<Texel>(41 * 23, color)});
  for (int level = 0; level <= pyramid.top(); ++level) {
    for (const Texel& texel : pyramid.level(level).texels) EXPECT_EQ(texel, color);
  }
}

TEST(MipPyramid, is_the_same_for_any_number_of_threads) {
  const TexelGrid picture = random_texels(200, 91, 3);
  const MipPyramid many(picture);
  with_threads(1, [&] {
    const MipPyramid one(picture);
    for (int level = 0; level <= one.top(); ++level) {
      EXPECT_EQ(one.level(level).texels, many.level(level).texels);
    }
  });
}

TEST(MipPyramid, looks_up_as_its_slow_twin_does) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> place(-3.0, 4.0);
  for (const auto& [width, height] : {std::pair(1, 1), {2, 7}, {31, 16}, {1, 64}}) {
    const MipPyramid pyramid(random_texels(width, height, 5));
    for (const Wrap u : kWraps) {
      for (const Wrap v : kWraps) {
        for (int n = 0; n < 300; ++n) {
          const Vec2d uv(place(random), place(random));
          const int level = n % (pyramid.top() + 1);
          expect_near(pyramid.bilinear(level, uv, {u, v}),
                      reference::bilinear(pyramid.level(level), uv, {u, v}), 4e-7);
        }
      }
    }
  }
}

TEST(MipPyramid, is_exact_at_centres_and_beyond_borders) {
  const MipPyramid pyramid(TexelGrid{2, 1, {Texel(0.25F), Texel(1.0F)}});
  const auto at = [&](double u, Wrap wrap) { return pyramid.bilinear(0, {u, 0.5}, {wrap, wrap}).x; };
  for (const Wrap wrap : kWraps) {
    EXPECT_EQ(at(0.25, wrap), 0.25F);
    EXPECT_EQ(at(0.75, wrap), 1.0F);
    EXPECT_EQ(at(0.5, wrap), 0.625F);
  }
  EXPECT_EQ(at(-0.25, Wrap::clamp), 0.25F);
  EXPECT_EQ(at(-0.25, Wrap::repeat), 1.0F) << "floor, not truncation";
  EXPECT_EQ(at(-0.25, Wrap::mirror), 0.25F);
  EXPECT_EQ(at(0.0, Wrap::repeat), 0.625F) << "halfway between the last texel and the first";
  EXPECT_EQ(at(1.0, Wrap::repeat), 0.625F);
  EXPECT_EQ(at(1.25, Wrap::mirror), 1.0F);
  EXPECT_EQ(at(1e9 + 0.25, Wrap::repeat), 0.25F);
}

/// The catalogue's bilinear patch (HMP-02), table[0,0] = 1, table[1,0] = 2, table[0,1] = 3, table[1,1] = 5, a
/// quarter of the way in x and half of it in y, as texels of a third the size.
TEST(MipPyramid, weighs_as_the_catalogue_of_hard_cases_says) {
  const MipPyramid pyramid(TexelGrid{2, 2, {Texel(1), Texel(2), Texel(3), Texel(5)}});
  EXPECT_EQ(pyramid.bilinear(0, {0.25 + 0.25 * 0.5, 0.5}, {Wrap::clamp, Wrap::clamp}).x, 2.375F);
}

TEST(MipPyramid, survives_places_that_are_no_numbers) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const MipPyramid pyramid(random_texels(8, 8, 6));
  for (const double u : {kInf, -kInf, std::nan(""), 1e300, -1e300, 1e-320, -1e-320}) {
    for (const Wrap wrap : kWraps) {
      const Texel texel = pyramid.trilinear(2.5, {u, u}, {wrap, wrap});
      for (int c = 0; c < 4; ++c) EXPECT_TRUE(texel[c] >= 0 && texel[c] <= 1) << u;
    }
  }
}

TEST(MipPyramid, goes_from_level_to_level_without_steps) {
  const MipPyramid pyramid(random_texels(48, 33, 7));
  const Vec2d uv(0.371, 0.642);
  const Wraps wraps;
  for (int level = 0; level <= pyramid.top(); ++level) {
    EXPECT_EQ(pyramid.trilinear(level, uv, wraps), pyramid.bilinear(level, uv, wraps));
  }
  EXPECT_EQ(pyramid.trilinear(-3, uv, wraps), pyramid.bilinear(0, uv, wraps));
  EXPECT_EQ(pyramid.trilinear(99, uv, wraps), pyramid.level(pyramid.top()).at(0, 0));
  Texel before = pyramid.trilinear(-0.5, uv, wraps);
  for (double level = -0.5; level < 7.0; level += 1.0 / 1024) {
    const Texel here = pyramid.trilinear(level, uv, wraps);
    for (int c = 0; c < 4; ++c) EXPECT_NEAR(here[c], before[c], 1.01 / 1024) << level;
    before = here;
  }
}

}  // namespace
}  // namespace pileus
