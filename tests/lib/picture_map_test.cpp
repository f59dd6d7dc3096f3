#include "lib/cloud/picture_map.h"

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/image/exr_io.h"
#include "tests/fixtures/hunt.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

/// A picture file whose red, green and blue are functions of the texel.
class Pictures {
 public:
  template <class Texel>
  std::filesystem::path write(int width, int height, const Texel& texel) const {
    Image image{width, height, {}, {}};
    for (const char* name : {"R", "G", "B"}) image.add(name);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const Rgb color = texel(x, y);
        for (size_t c = 0; c < 3; ++c) image.channels[c].values[size_t(y * width + x)] = float(color[int(c)]);
      }
    }
    const std::filesystem::path file = m_folder / "picture.exr";
    write_exr(file, image, {});
    return file;
  }

 private:
  TempFolder m_folder;
};

const Box3d kBox{{-2, 0, -1}, {2, 1, 1}};

PictureMapRecipe recipe_of(const std::filesystem::path& file, const std::string& channel = "red") {
  PictureMapRecipe recipe;
  recipe.file = file;
  recipe.channel = channel;
  return recipe;
}

TEST(PictureMap, lies_over_the_box_as_seen_from_above) {
  const Pictures pictures;
  const auto file = pictures.write(4, 2, [](int x, int y) { return Rgb(x / 4.0, y / 2.0, 0); });
  const PictureMap red(recipe_of(file), kBox), green(recipe_of(file, "green"), kBox);
  // Texel (x, y) has its centre at -2 + (x + 1/2), and the picture's top at z = -1.
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 2; ++y) {
      const Vec3d p(-1.5 + x, 0.3, -0.5 + y);
      EXPECT_NEAR(red.value(p), x / 4.0, 1e-12) << p;
      EXPECT_NEAR(green.value(p), y / 2.0, 1e-12) << p;
      EXPECT_NEAR(red.color(p).y, y / 2.0, 1e-12);
    }
  }
  EXPECT_NEAR(red.value({-1, 0.5, -0.5}), 0.125, 1e-12) << "half way between the first two";
}

TEST(PictureMap, repeats_without_end) {
  const Pictures pictures;
  const auto file = pictures.write(5, 3, [](int x, int y) { return Rgb((x * 7 + y * 5) % 9 / 9.0, 0, 0); });
  PictureMapRecipe recipe = recipe_of(file);
  recipe.tiles = {2, 1};
  const PictureMap map(recipe, kBox);
  for (const double x : {-1.7, -0.3, 0.9}) {
    EXPECT_NEAR(map.value({x, 0, 0.2}), map.value({x + 2, 0, 0.2}), 1e-12);
    EXPECT_NEAR(map.value({x, 0, 0.2}), map.value({x - 20, 0, 0.2 + 8}), 1e-12);
  }
}

TEST(PictureMap, density_may_be_inverse_to_the_colour_and_is_never_infinite) {
  const Pictures pictures;
  const auto file = pictures.write(2, 1, [](int x, int) { return Rgb(x, x, x); });
  PictureMapRecipe recipe = recipe_of(file, "luminance");
  recipe.inverse = true;
  const PictureMap map(recipe, kBox);
  EXPECT_NEAR(map.value({-1, 0, 0}), 1, 1e-6) << "black";
  EXPECT_NEAR(map.value({1, 0, 0}), 0, 1e-6) << "white";
}

TEST(PictureMap, levels_stretch_and_clamp) {
  const Pictures pictures;
  const auto file = pictures.write(3, 1, [](int x, int) { return Rgb(x * 0.5, 0, 0); });
  PictureMapRecipe recipe = recipe_of(file);
  recipe.levels = {0.25, 0.75};
  const PictureMap map(recipe, {{0, 0, 0}, {3, 1, 1}});
  EXPECT_EQ(map.value({0.5, 0, 0.5}), 0);
  EXPECT_NEAR(map.value({1.5, 0, 0.5}), 0.5, 1e-12);
  EXPECT_EQ(map.value({2.5, 0, 0.5}), 1);
}

TEST(PictureMap, a_sphere_has_its_poles_on_the_axis) {
  const Pictures pictures;
  const auto file = pictures.write(8, 4, [](int, int y) { return Rgb(y / 3.0, 0, 0); });
  PictureMapRecipe recipe = recipe_of(file);
  recipe.projection = "spherical";
  const PictureMap map(recipe, {Vec3d(-1), Vec3d(1)});
  const double quarter = std::sqrt(0.5);
  EXPECT_NEAR(map.value({0, 0.1, 0.1 * std::tan(3.14159265 / 8)}), 0, 1e-6) << "first row: 67.5 degrees up";
  EXPECT_NEAR(map.value({quarter, 0, quarter}), 0.5, 1e-6)
      << "the equator is between the second and the third";
}

TEST(PictureMap, ranges_hold_for_planes_and_spheres) {
  const Pictures pictures;
  std::mt19937_64 random(3);
  const auto uniform = [&](double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random);
  };
  const auto file = pictures.write(37, 21, [&](int, int) { return Rgb(uniform(0, 1), 0, 0); });
  int tight = 0;
  for (int n = 0; n < hunted(60); ++n) {
    PictureMapRecipe recipe = recipe_of(file);
    recipe.projection = n % 2 ? "spherical" : "planar";
    recipe.axis = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
    recipe.turn_deg = uniform(-180, 180);
    recipe.tiles = {uniform(0.3, 4), uniform(0.3, 4)};
    const PictureMap map(recipe, kBox);
    for (int b = 0; b < 40; ++b) {
      const double edge = std::pow(10.0, uniform(-4, 0.5));
      const Vec3d at(uniform(-2.5, 2), uniform(-0.5, 1), uniform(-1.5, 1));
      const Box3d box(at, at + Vec3d(edge * uniform(0, 1), edge * uniform(0, 1), edge * uniform(0, 1)));
      const Interval range = map.range(box);
      tight += range.width() < 0.3;
      for (int i = 0; i < 20; ++i) {
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis) {
          p[axis] = i < 8 ? (i >> axis & 1 ? box.max : box.min)[axis] : uniform(box.min[axis], box.max[axis]);
        }
        ASSERT_TRUE(range.contains(map.value(p))) << recipe.projection << " " << p << ": " << map.value(p)
                                                  << " not in " << range.lo << " .. " << range.hi;
      }
    }
  }
  EXPECT_GT(tight, 200);
}

TEST(PictureMap, refuses_what_is_no_such_picture) {
  const Pictures pictures;
  EXPECT_THROW(PictureMap(recipe_of("no/such/file.png"), kBox), Error);
  const auto file = pictures.write(2, 2, [](int x, int) { return Rgb(x ? NAN : 1, 0, 0); });
  EXPECT_THROW(PictureMap(recipe_of(file), kBox), Error);
  const auto opaque = pictures.write(2, 2, [](int, int) { return Rgb(1, 1, 1); });
  try {
    PictureMap(recipe_of(opaque, "alpha"), kBox);
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("has no channel A"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace pileus
