// Textures as scenes make them: read, placed, named by surfaces, looked up.
#include <cmath>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/image/image_io.h"
#include "lib/scene/effect_plan.h"
#include "lib/scene/scene.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

const std::string kHead = "pileus = 1\n[camera]\ntype = \"perspective\"\nposition = [0, 0, 9]\n";

Scene scene_of(const std::string& text, const std::filesystem::path& folder = ".") {
  return parse_scene(kHead + text, "s.toml", folder);
}

std::shared_ptr<const Texture> texture_of(const std::string& params,
                                          const std::filesystem::path& folder = ".") {
  return scene_of("[texture.t]\n" + params, folder).textures.at(0).object;
}

/// What is wrong with a scene, as one line per problem.
std::string problems_of(const std::string& text, const std::filesystem::path& folder = ".") {
  try {
    scene_of(text, folder);
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

TextureValue look(const Texture& texture, const Vec3d& p, const Vec3d& n = {0, 1, 0}, double width = 0.0) {
  return texture.at({p, n, Vec3d(width, 0, 0), Vec3d(0, 0, width)});
}

/// A picture of 2 x 2 texels: red, green, blue and half transparent white.
std::filesystem::path four_colors(const TempFolder& folder) {
  Image image{2, 2, {}, {}};
  image.add("R").values = {1, 0, 0, 0.5F};
  image.add("G").values = {0, 1, 0, 0.5F};
  image.add("B").values = {0, 0, 1, 0.5F};
  image.add("A").values = {1, 1, 1, 0.5F};
  write_image(folder / "four.exr", image);
  return folder.path();
}

TEST(ImageTexture, lies_where_it_is_put) {
  const TempFolder folder;
  const auto texture = texture_of(
      "type = \"image\"\nfile = \"four.exr\"\nfilter = \"nearest\"\nscale = [4, 1, 4]\ntranslate = [10, 0, "
      "0]\n",
      four_colors(folder));
  EXPECT_EQ(look(*texture, {9, 5, -1}).color, Rgb(1, 0, 0)) << "north-west, at any height";
  EXPECT_EQ(look(*texture, {11, 0, -1}).color, Rgb(0, 1, 0));
  EXPECT_EQ(look(*texture, {9, 0, 1}).color, Rgb(0, 0, 1));
  const TextureValue glassy = look(*texture, {11, 0, 1});
  EXPECT_EQ(glassy.color, Rgb(1, 1, 1)) << "not darkened by its alpha";
  EXPECT_EQ(glassy.opacity, 0.5);
  EXPECT_EQ(look(*texture, {13, 0, -1}).color, Rgb(1, 0, 0)) << "again";
}

TEST(ImageTexture, stands_upright_when_turned) {
  const TempFolder folder;
  const auto texture =
      texture_of("type = \"image\"\nfile = \"four.exr\"\nfilter = \"nearest\"\nrotate_deg = [90, 0, 0]\n",
                 four_colors(folder));
  EXPECT_EQ(look(*texture, {-0.25, 0.25, 3}).color, Rgb(1, 0, 0)) << "top left, seen from +z";
  EXPECT_EQ(look(*texture, {0.25, 0.25, 3}).color, Rgb(0, 1, 0));
  EXPECT_EQ(look(*texture, {-0.25, -0.25, 3}).color, Rgb(0, 0, 1));
}

TEST(ImageTexture, has_no_seam_and_no_cracked_poles) {
  const TempFolder folder;
  for (const std::string projection : {"spherical", "cylindrical"}) {
    for (const std::string wrap : {"repeat", "clamp"}) {
      const auto texture = texture_of("type = \"image\"\nfile = \"four.exr\"\nprojection = \"" + projection +
                                          "\"\nwrap_u = \"" + wrap + "\"\n",
                                      four_colors(folder));
      const TextureValue left = look(*texture, {-1e-9, 0.3, -1}), right = look(*texture, {1e-9, 0.3, -1});
      EXPECT_LT(length(left.color - right.color), 1e-6) << projection << " " << wrap;
      EXPECT_GT(left.color.x, 0.1) << "both colours of the row meet there";
      EXPECT_GT(left.color.y, 0.1);
    }
  }
}

/// A picture of 16 x 8 texels of random colours.
std::filesystem::path random_texels(const TempFolder& folder) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<float> value(0, 1);
  Image image{16, 8, {}, {}};
  for (const char* channel : {"R", "G", "B"}) {
    std::vector<float>& values = image.add(channel).values;
    values.resize(16 * 8);
    for (float& v : values) v = value(rng);
  }
  write_image(folder / "random.exr", image);
  return folder.path();
}

/// The slow twin: very many looks at points.
Rgb mean_of_looks(const Texture& texture, const Vec3d& p, double width) {
  constexpr int kSide = 96;
  Rgb sum(0.0);
  for (int i = 0; i < kSide * kSide; ++i) {
    const double x = (i % kSide + 0.5) / kSide - 0.5, z = (double(i / kSide) + 0.5) / kSide - 0.5;
    sum += look(texture, p + width * Vec3d(x, 0, z)).color;
  }
  return sum / double(kSide * kSide);
}

double largest(const Rgb& rgb) {
  return std::max({std::fabs(rgb.x), std::fabs(rgb.y), std::fabs(rgb.z)});
}

TEST(ImageTexture, is_averaged_around_a_pole_as_anywhere) {
  const TempFolder folder;
  for (const std::string projection : {"spherical", "cylindrical"}) {
    const auto globe =
        texture_of("type = \"image\"\nfile = \"random.exr\"\nprojection = \"" + projection + "\"\n",
                   random_texels(folder));
    const double height = projection == "spherical" ? 1.0 : 0.2;
    for (const double width : {1e-4, 0.01, 0.1, 0.3}) {
      for (const double away : {0.0, 1e-4, 0.2, 0.5, 0.7, 1.0, 2.0}) {  // footprints
        for (int i = 0; i < 7; ++i) {
          const double angle = i * 0.9;
          const Vec3d p = Vec3d(std::sin(angle), 0, std::cos(angle)) * (away * width) + Vec3d(0, height, 0);
          EXPECT_LT(largest(look(*globe, p, {0, 1, 0}, width).color - mean_of_looks(*globe, p, width)), 0.03)
              << projection << ", " << width << " wide, " << away << " of that from the pole, to " << angle;
        }
      }
    }
  }
}

TEST(ImageTexture, derives_opacity_as_it_is_told) {
  const TempFolder folder;
  const auto opacity = [&](const std::string& how) {
    const auto texture =
        texture_of("type = \"image\"\nfile = \"four.exr\"\nfilter = \"nearest\"\nopacity = \"" + how + "\"\n",
                   four_colors(folder));
    return std::pair(look(*texture, {0.25, 0, -0.25}).opacity, texture->is_opaque());
  };
  EXPECT_EQ(opacity("alpha"), std::pair(1.0, false));
  EXPECT_EQ(opacity("full"), std::pair(1.0, true));
  EXPECT_NEAR(opacity("luminance").first, 0.7152, 1e-12);
  EXPECT_NEAR(opacity("inverse_luminance").first, 1 - 0.7152, 1e-12);
}

TEST(ImageTexture, takes_values_as_their_encoding_says) {
  const TempFolder folder;
  std::ofstream(folder / "a.ppm") << "P3 1 1 255\n51 102 255\n";
  const auto color = [&](const std::string& encoding) {
    return look(*texture_of("type = \"image\"\nfile = \"a.ppm\"\nencoding = \"" + encoding + "\"\n",
                            folder.path()),
                {0, 0, 0})
        .color;
  };
  EXPECT_LT(length(color("linear") - Rgb(0.2, 0.4, 1)), 1e-6);
  EXPECT_LT(length(color("srgb") - Rgb(linear_from_srgb(0.2), linear_from_srgb(0.4), 1)), 1e-6);
  EXPECT_EQ(color("auto"), color("srgb"));
}

TEST(ImageTexture, refuses_what_is_no_picture_of_a_surface) {
  const TempFolder folder;
  const auto problem = [&](const std::string& params) {
    return problems_of("[texture.t]\ntype = \"image\"\n" + params, folder.path());
  };
  EXPECT_NE(problem("").find("parameter \"file\" is missing"), std::string::npos);
  EXPECT_NE(problem("file = \"none.png\"\n").find("does not exist"), std::string::npos);
  std::ofstream(folder / "text.png") << "no picture";
  EXPECT_NE(problem("file = \"text.png\"\n").find("cannot be read as a picture"), std::string::npos);
  Image image{1, 2, {}, {}};
  image.add("Y").values = {0.5F, 1.5F};
  write_image(folder / "bright.exr", image);
  EXPECT_NE(problem("file = \"bright.exr\"\n").find("channel Y is 1.5 at pixel (0, 1); expected 0 to 1"),
            std::string::npos);
  image.channels[0].values = {NAN, 0.5F};
  write_image(folder / "nan.exr", image);
  EXPECT_NE(problem("file = \"nan.exr\"\n").find("is nan at pixel (0, 0)"), std::string::npos);
  image.channels[0].name = "Z";
  write_image(folder / "depth.exr", image);
  EXPECT_NE(problem("file = \"depth.exr\"\n").find("has the channels Z; expected R, G and B, or Y"),
            std::string::npos);
}

TEST(CheckerTexture, is_averaged_exactly) {
  const auto texture =
      texture_of("type = \"checker\"\ntiles_u = 1\ntiles_v = 1\ntranslate = [0.5, 0, 0.5]\n");
  EXPECT_EQ(look(*texture, {0.2, 3, 0.2}).color, Rgb(1.0));
  EXPECT_EQ(look(*texture, {1.2, 3, 0.2}).color, Rgb(0.0));
  EXPECT_EQ(look(*texture, {-0.2, 3, -0.2}).color, Rgb(1.0));
  EXPECT_NEAR(look(*texture, {1, 0, 0.5}, {0, 1, 0}, 0.5).color.x, 0.5, 1e-12) << "on an edge";
  EXPECT_NEAR(look(*texture, {0.9, 0, 0.5}, {0, 1, 0}, 0.4).color.x, 0.75, 1e-12);
  EXPECT_NEAR(look(*texture, {0.3, 0, 0.5}, {0, 1, 0}, 1e6).color.x, 0.5, 1e-5);
}

TEST(NoiseTexture, fades_to_its_mean_where_it_is_too_fine) {
  for (const std::string kind : {"fbm", "billow", "ridged"}) {
    const auto texture = texture_of("type = \"noise\"\nkind = \"" + kind + "\"\nfrequency = 3\n");
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> place(-50.0, 50.0);
    double sum = 0.0;
    constexpr int kPoints = 20000;
    for (int i = 0; i < kPoints; ++i) {
      sum += look(*texture, {place(random), place(random), place(random)}).color.x;
    }
    EXPECT_NEAR(look(*texture, {1, 2, 3}, {0, 1, 0}, 10).color.x, sum / kPoints, 0.01) << kind;
  }
}

TEST(RampTexture, colours_by_height_slope_and_steepness) {
  const std::string stops = "stops = [{ at = 10, color = [0, 0, 0] }, { at = 20, color = [1, 0.5, 0] }]\n";
  const auto height = texture_of("type = \"ramp\"\n" + stops + "translate = [0, 100, 0]\n");
  EXPECT_EQ(look(*height, {7, 105, 3}).color, Rgb(0.0));
  EXPECT_LT(length(look(*height, {7, 115, 3}).color - Rgb(0.5, 0.25, 0)), 1e-12);
  EXPECT_EQ(look(*height, {7, 999, 3}).color, Rgb(1, 0.5, 0));
  const auto slope = texture_of("type = \"ramp\"\nof = \"slope\"\n" + stops);
  const double angle = 15 * M_PI / 180;
  for (const double side : {1.0, -1.0}) {
    const Vec3d n = side * Vec3d(std::sin(angle), std::cos(angle), 0);
    EXPECT_LT(length(look(*slope, {0, 0, 0}, n).color - Rgb(0.5, 0.25, 0)), 1e-12) << "from either side";
  }
  const auto steep =
      texture_of("type = \"ramp\"\n" + stops + "steep = { from_deg = 30, to_deg = 60, color = [0, 0, 1] }\n");
  EXPECT_EQ(look(*steep, {0, 0, 0}, {0, 1, 0}).color, Rgb(0.0));
  EXPECT_LT(length(look(*steep, {0, 0, 0}, normalize(Vec3d(1, 1, 0))).color - Rgb(0, 0, 0.5)), 1e-12);
  EXPECT_EQ(look(*steep, {0, 0, 0}, {1, 0, 0}).color, Rgb(0, 0, 1));
}

TEST(RampTexture, refuses_stops_in_disorder) {
  EXPECT_NE(problems_of("[texture.t]\ntype = \"ramp\"\nstops = []\n").find("stops is empty"),
            std::string::npos);
  EXPECT_NE(problems_of("[texture.t]\ntype = \"ramp\"\n").find("\"stops\" is missing"), std::string::npos);
  EXPECT_NE(
      problems_of("[texture.t]\ntype = \"ramp\"\nstops = [{ at = 2, color = [0, 0, 0] }, { at = 1, color = "
                  "[0, 0, 0] }]\n")
          .find("stops: 1 comes after 2"),
      std::string::npos);
}

TEST(Texture, is_named_by_surfaces_and_misspelt_names_are_told) {
  const std::string board = "[texture.board]\ntype = \"checker\"\n";
  const auto object = [](const std::string& name) {
    return "[object." + name + "]\ntype = \"sphere\"\nshader = { type = \"ggx\", texture = \"board\" }\n";
  };
  const Scene scene = scene_of(board + object("a") + object("b"));
  EXPECT_EQ(scene.objects[0].object->shader->texture, scene.textures[0].object);
  EXPECT_EQ(scene.objects[1].object->shader->texture, scene.textures[0].object) << "one for both";
  EXPECT_EQ(problems_of("[texture.bord]\ntype = \"checker\"\n" + object("a")),
            "s.toml:9:36: error: object \"a\": surface: there is no texture \"board\"; the scene has bord; "
            "nearest: bord");
}

TEST(Texture, is_an_effect_of_its_own) {
  const auto effect = [](const std::string& text, const std::string& name) {
    for (const Effect& e : plan_effects(scene_of(text)).effects) {
      if (e.name == name) return std::pair(e.on, e.reason);
    }
    return std::pair(false, std::string("missing"));
  };
  const std::string texture = "[texture.t]\ntype = \"checker\"\n";
  const std::string bare = "[object.ball]\ntype = \"sphere\"\n";
  EXPECT_EQ(effect(texture + bare, "textures"), std::pair(false, std::string("no object names a texture")));
  const std::string dressed = bare + "shader = { type = \"phong\", texture = \"t\" }\n";
  EXPECT_EQ(effect(texture + dressed, "textures"),
            std::pair(true, std::string("objects with a texture: ball")));
  EXPECT_EQ(effect(texture + dressed, "holes"), std::pair(false, std::string("all textures are opaque")));
  EXPECT_TRUE(effect(texture + "opacity = \"luminance\"\n" + dressed, "holes").first);
}

}  // namespace
}  // namespace pileus
