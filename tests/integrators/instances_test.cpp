// Instances of volumes against the same volumes placed one by one, and what is refused.
#include <algorithm>
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/volume/brick_grid.h"
#include "tests/fixtures/march_scenes.h"
#include "tests/fixtures/picture_scene.h"

namespace pileus {
namespace {

const MarchScenes& scenes() {
  static const MarchScenes all;
  return all;
}

/// Four blobs, two of which overlap, and two that throw their shadows on others.
struct Place {
  const char* scale;
  const char* rotate_deg;
  const char* translate;
};
constexpr Place kPlaces[] = {{"[0.6, 0.6, 0.6]", "[0, 30, 0]", "[-1.4, 0, 0]"},
                             {"[0.5, 0.5, 0.5]", "[0, 0, 0]", "[-0.4, 0.2, 0.3]"},
                             {"[0.4, 0.4, 0.4]", "[0, 30, 0]", "[1.5, -0.8, 0]"},
                             {"[0.3, 0.3, 0.3]", "[0, 90, 0]", "[1.8, 0.9, 0.9]"}};

const std::string kLight =
    "extinction = 6\nalbedo = [1, 0.9, 0.8]\nphase = { type = \"hg\", g = 0.5 }\n"
    "ambient = { top = [0.2, 0.4, 0.8], bottom = [0.2, 0.4, 0.8] }\nmultiple_scattering = { octaves = 3 }\n";

std::string placed(const Place& place) {
  return fmt::format("scale = {}\nrotate_deg = {}\ntranslate = {}\n", place.scale, place.rotate_deg,
                     place.translate);
}

std::string view() {
  return MarchScenes::camera() + MarchScenes::sun() +
         "[background]\ntype = \"constant\"\nradiance = [0.3, 0.5, 0.9]\n";
}

std::string one_by_one() {
  std::string text = view();
  for (size_t n = 0; n < std::size(kPlaces); ++n)
    text += scenes().grid("blob", kLight + placed(kPlaces[n]), "blob" + std::to_string(n));
  return text;
}

std::string instanced() {
  std::string text = view() + scenes().grid("blob", kLight + "hidden = true\n", "original") +
                     "[volume.all]\ntype = \"instance\"\nof = \"original\"\nplacements = [";
  for (const Place& place : kPlaces) {
    text += fmt::format("{{ scale = {}, rotate_deg = {}, translate = {} }}, ", place.scale, place.rotate_deg,
                        place.translate);
  }
  return text + "]\n";
}

double worst_difference(const std::vector<RayResult>& a, const std::vector<RayResult>& b) {
  double worst = 0.0;
  for (size_t i = 0; i < a.size(); ++i) {
    const Rgb d = a[i].radiance - b[i].radiance;
    worst = std::max({worst, std::abs(d.x), std::abs(d.y), std::abs(d.z),
                      std::abs(a[i].transmittance - b[i].transmittance)});
  }
  return worst;
}

std::string complaint(const std::string& text) {
  try {
    build_world(parse_scene("pileus = 1\n" + MarchScenes::camera() + text, "test", ""));
  } catch (const Error& error) {
    return error.diagnostics()[0].message;
  }
  return "";
}

TEST(VolumeInstances, look_like_volumes_placed_one_by_one) {
  const PictureScene several("\"exact\"", one_by_one(), 1e-5), instances("\"exact\"", instanced(), 1e-5);
  ASSERT_EQ(instances.world().media.size(), 1u);
  EXPECT_EQ(instances.world().media[0].extinction, 6.0) << "light does what it does in the original";
  const auto expected = several.picture(24), got = instances.picture(24);
  EXPECT_LT(worst_difference(got, expected), 2e-5);
  size_t seen = 0;
  for (const RayResult& ray : got) seen += ray.transmittance < 0.9 ? 1 : 0;
  EXPECT_GT(seen, 60u);
}

/// A layer of instances, turned in four ways, of many sizes; many shade others.
std::string layer(const std::string& light) {
  std::string text = MarchScenes::camera("[0, 4, 26]", "[0, -1, 0]", 34) +
                     MarchScenes::sun("sun", "[0.7, 0.5, 0.3]") +
                     MarchScenes::sun("moon", "[-0.5, 0.9, -0.4]", "[1, 2, 4]") +
                     "[background]\ntype = \"constant\"\nradiance = [0.3, 0.5, 0.9]\n" +
                     scenes().grid("blob", light + "hidden = true\n", "original") +
                     "[volume.all]\ntype = \"instance\"\nof = \"original\"\nplacements = [";
  for (int n = 0; n < 120; ++n) {
    const double scale = 0.3 + 0.05 * (n * 7 % 11);
    text += fmt::format("{{ scale = [{}, {}, {}], rotate_deg = [0, {}, 0], translate = [{}, {}, {}] }}, ",
                        scale, scale, scale, 90 * (n % 4), 1.9 * (n % 12) - 10.5, 0.4 * (n * 5 % 7) - 1.0,
                        2.3 * (n / 12) - 14.0);
  }
  return text + "]\n";
}

void expect_march_within_tolerance(const std::string& integrator, const std::string& text) {
  const auto expected = PictureScene("\"exact\"", text, 2e-5).picture(64);
  for (const double tolerance : {0.03, 0.01, 0.003}) {
    const PictureScene march(integrator, text, tolerance);
    for (const std::string& choice : march.tracer().choices())
      EXPECT_EQ(choice.find("\"exact\""), std::string::npos) << choice;
    const auto got = march.picture(64);
    const double worst = worst_difference(got, expected);
    EXPECT_LE(worst, tolerance) << integrator;
    testing::Test::RecordProperty(fmt::format("worst_at_{}", tolerance),
                                  fmt::format("{:.3g}", worst / tolerance));
    const auto one_by_one = march.picture(16);
    EXPECT_EQ(worst_difference(one_by_one, got), 0.0) << "packets do not depend on what else is traced";
  }
}

TEST(VolumeInstances, are_marched_within_the_tolerance) {
  expect_march_within_tolerance("\"march\"", instanced());
}

TEST(VolumeInstances, shade_each_other_in_the_march) {
  expect_march_within_tolerance("\"march\"", layer(kLight));
}

TEST(VolumeInstances, are_marched_beside_a_grid_and_a_solid_that_shades_them) {
  expect_march_within_tolerance(
      "\"march\"",
      instanced() +
          scenes().grid("random", "extinction = 1\nemission = [0.1, 0.2, 0]\ntranslate = [0, -1, -1]\n",
                        "other") +
          MarchScenes::ball("ball", "[0.6, 1.6, 1]", 0.4));
}

TEST(VolumeInstances, are_marched_with_shadow_rays) {
  expect_march_within_tolerance("{ type = \"march\", sun_cache = false }", instanced());
}

TEST(VolumeInstances, glow_in_the_march) {
  expect_march_within_tolerance("\"march\"", layer("extinction = 0\nemission = [0.2, 0.3, 0.1]\n"));
}

TEST(VolumeInstances, go_to_exact_where_the_march_cannot_do_them) {
  const auto choice_of = [](const std::string& text) {
    return PictureScene("\"march\"", text, 0.01).tracer().choices().at(0);
  };
  EXPECT_NE(choice_of(instanced() + MarchScenes::haze("extinction = 0.1\n")).find("some volume is no grid"),
            std::string::npos);
}

/// Each ray of a picture: no channel errs by more than its bound, and bounds are not much larger than errors.
void expect_bounds(const std::string& text) {
  const auto expected = PictureScene("\"exact\"", text, 1e-7).picture(64);
  const auto got = PictureScene("\"march\"", "aovs = \"beauty, error_bound\"\n" + text, 0.01).picture(64);
  std::vector<double> ratios;
  for (size_t i = 0; i < got.size(); ++i) {
    const Rgb d = got[i].radiance - expected[i].radiance;
    const double error = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
    EXPECT_LE(error, got[i].bound + expected[i].error + 1e-9) << "ray " << i;
    if (error > 1e-6) ratios.push_back(got[i].bound / error);
  }
  ASSERT_GT(ratios.size(), 100u);
  std::nth_element(ratios.begin(), ratios.begin() + std::ptrdiff_t(ratios.size() / 2), ratios.end());
  EXPECT_LT(ratios[ratios.size() / 2], 10.0);
}

TEST(VolumeInstances, have_proven_bounds_in_the_march) {
  expect_bounds(instanced());
}

TEST(VolumeInstances, that_shade_each_other_have_proven_bounds_in_the_march) {
  expect_bounds(layer(kLight));
}

TEST(VolumeInstances, take_the_light_of_their_original_through_instances) {
  const std::string text = view() + scenes().grid("blob", kLight + "hidden = true\n", "z_original") +
                           "[volume.row]\ntype = \"instance\"\nof = \"z_original\"\nhidden = true\n"
                           "placements = [{}, { translate = [5, 0, 0] }]\n"
                           "[volume.all]\ntype = \"instance\"\nof = \"row\"\ntranslate = [0, 1, 0]\n"
                           "placements = [{}, { translate = [0, 0, 5] }, { translate = [0, 0, 9] }]\n";
  const World world = build_world(parse_scene("pileus = 1\n" + text, "test", ""));
  ASSERT_EQ(world.media.size(), 1u);
  EXPECT_EQ(world.media[0].density->places().size(), 6u);
  EXPECT_EQ(world.media[0].albedo, Rgb(1, 0.9, 0.8));
  EXPECT_EQ(world.media[0].scattering.size(), 3u);
}

TEST(VolumeInstances, that_make_no_sense_are_refused) {
  EXPECT_EQ(
      complaint("[volume.b]\ntype = \"box\"\n[volume.a]\ntype = \"instance\"\nof = \"b\"\n"),
      "volume \"a\": volume \"b\" is no grid of voxels; expected a cloud, a volume file or instances of "
      "one");
  EXPECT_NE(complaint("[volume.a]\ntype = \"instance\"\nof = \"b\"\n[volume.b]\ntype = \"instance\"\nof = "
                      "\"a\"\n")
                .find("volume \"a\" is made of itself"),
            std::string::npos);
  EXPECT_NE(complaint("[volume.a]\ntype = \"instance\"\nof = \"blop\"\n[volume.blob]\ntype = \"box\"\n")
                .find("there is no volume \"blop\"; the scene has a or blob; nearest: blob"),
            std::string::npos);
  EXPECT_NE(complaint("[volume.a]\ntype = \"instance\"\nof = \"b\"\nextinction = 3\n[volume.b]\ntype = "
                      "\"box\"\n")
                .find("unknown parameter \"extinction\""),
            std::string::npos);
}

/// Ten thousand for the memory of one: what is added is some hundred bytes for each place.
TEST(VolumeInstances, of_ten_thousand_share_the_voxels_of_one) {
  TempFolder folder;
  std::ofstream table(folder / "places.csv");
  for (int n = 0; n < 10000; ++n)
    table << 9 * (n % 100) << ",0," << 9 * (n / 100) << ",1," << n % 360 << '\n';
  table.close();
  const std::string text = view() + scenes().grid("blob", kLight, "original") +
                           "[volume.all]\ntype = \"instance\"\nof = \"original\"\nfile = \"places.csv\"\n";
  const World world = build_world(parse_scene("pileus = 1\n" + text, "test", folder.path()));
  ASSERT_EQ(world.media.size(), 2u);
  EXPECT_EQ(world.media[0].density->places().size(), 10000u);
  EXPECT_EQ(world.media[0].density->bricks(), world.media[1].density->bricks());
}

}  // namespace
}  // namespace pileus
