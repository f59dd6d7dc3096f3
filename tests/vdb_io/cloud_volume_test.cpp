#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lib/cloud/cloud_presets.h"
#include "lib/core/error.h"
#include "lib/scene/scene.h"
#include "vdb_io/openvdb/build_cloud.h"
#include "vdb_io/volumes/cloud.h"

namespace pileus {
namespace {

/// A scene with one cloud; `parameters` are further lines of its section.
Scene scene_with_cloud(const std::string& parameters) {
  const std::string text = R"(pileus = 1
[camera]
type = "perspective"
[freeform.blob]
base = { ellipsoid = { center = [0, 1.6, 0], radii = [3, 1.6, 2.2] } }
[volume.cumulus]
type = "cloud"
)";
  return parse_scene(text + parameters, "clouds.toml", ".");
}

std::string refusal(const std::string& parameters) {
  try {
    scene_with_cloud(parameters);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(CloudVolume, bounds_and_voxel_size_make_a_cloud) {
  const Scene scene = scene_with_cloud("bounds = \"blob\"\nvoxel_size = 0.1\n");
  const auto field = scene.volumes.at(0).object->build(scene.freeforms);
  EXPECT_GT(field->max_density(), 0.9);
  EXPECT_LE(field->max_density(), 1.0);
  FieldCounters counters;
  const Ray upwards{{0, -1, 0}, {0, 1, 0}};
  EXPECT_GT(field->column(upwards, {0, 10}, 1e9, counters), 0.5);
  const Ray beside{{4, -1, 0}, {0, 1, 0}};
  EXPECT_EQ(field->column(beside, {0, 10}, 1e9, counters), 0.0);
}

TEST(CloudVolume, its_grid_is_there_for_exporters) {
  const Scene scene = scene_with_cloud("bounds = \"blob\"\nvoxel_size = 0.1\n");
  const auto cloud = std::dynamic_pointer_cast<const CloudVolume>(scene.volumes.at(0).object);
  ASSERT_TRUE(cloud);
  EXPECT_GT(build_cloud(cloud->cloud(scene.freeforms), cloud->grid_options())->activeVoxelCount(), 5000u);
}

TEST(CloudVolume, reads_its_recipe) {
  const Scene scene = scene_with_cloud(
      "bounds = \"blob\"\nvoxel_size = 0.1\nthreshold = 0.25\nnoise = { octaves = 3, frequency = 1.3 }\n"
      "height_profile = [[0, 0], [0.15, 1], [1, 0]]\n");
  const auto cloud = std::dynamic_pointer_cast<const CloudVolume>(scene.volumes.at(0).object);
  ASSERT_TRUE(cloud);
  EXPECT_EQ(cloud->recipe.threshold, 0.25);
  EXPECT_EQ(cloud->recipe.noise.octaves, 3);
  EXPECT_EQ(cloud->recipe.noise.frequency, 1.3);
  EXPECT_EQ(cloud->recipe.noise.gain, CloudRecipe{}.noise.gain);
  EXPECT_EQ(cloud->recipe.height_profile, (std::vector<Vec2d>{{0, 0}, {0.15, 1}, {1, 0}}));
}

TEST(CloudVolume, a_preset_sets_defaults_that_others_override_wherever_they_stand) {
  const Scene scene = scene_with_cloud(
      "bounds = \"blob\"\nvoxel_size = 0.1\nedge = 0.25\nnoise = { octaves = 3 }\npreset = \"cirrus\"\n");
  const auto cloud = std::dynamic_pointer_cast<const CloudVolume>(scene.volumes.at(0).object);
  ASSERT_TRUE(cloud);
  const CloudRecipe cirrus = cloud_preset("cirrus");
  EXPECT_EQ(cloud->recipe.preset, "cirrus");
  EXPECT_EQ(cloud->recipe.edge, 0.25);
  EXPECT_EQ(cloud->recipe.noise.octaves, 3);
  EXPECT_EQ(cloud->recipe.noise.type, cirrus.noise.type);
  EXPECT_EQ(cloud->recipe.sharpness, cirrus.sharpness);
}

TEST(CloudVolume, the_voxel_size_may_follow_from_a_limit) {
  const Scene scene = scene_with_cloud("bounds = \"blob\"\nmax_voxels = 30000\n");
  const auto cloud = std::dynamic_pointer_cast<const CloudVolume>(scene.volumes.at(0).object);
  ASSERT_TRUE(cloud);
  EXPECT_NEAR(build_cloud(cloud->cloud(scene.freeforms), cloud->grid_options())->voxelSize().x(), 0.141,
              0.01);
}

TEST(CloudVolume, refuses_bad_recipes) {
  const std::string valid = "bounds = \"blob\"\nvoxel_size = 0.1\n";
  EXPECT_EQ(refusal(valid), "");
  EXPECT_NE(refusal("bounds = \"blob\"\n").find("voxel_size"), std::string::npos);
  EXPECT_NE(refusal("bounds = \"blob\"\nvoxel_size = 0\n").find("voxel_size is missing"), std::string::npos);
  EXPECT_NE(refusal("bounds = \"blob\"\nvoxel_size = -1\n").find("voxel_size"), std::string::npos);
  EXPECT_NE(refusal(valid + "preset = \"cirus\"\n").find("nearest: cirrus"), std::string::npos);
  EXPECT_NE(refusal(valid + "shear = [1, 1, 0]\n").find("expected 0 along y"), std::string::npos);
  EXPECT_NE(refusal(valid + "width_profile = [[0, 0]]\n").find("width_profile point 1"), std::string::npos);
  EXPECT_NE(refusal(valid + "coverage_map = { channel = \"red\" }\n").find("coverage_map has no file"),
            std::string::npos);
  EXPECT_NE(refusal(valid + "texture = { file = \"a.png\", black = 1 }\n").find("expected black < white"),
            std::string::npos);
  EXPECT_NE(refusal("bounds = \"blub\"\nvoxel_size = 0.1\n").find("nearest: blob"), std::string::npos);
  EXPECT_NE(refusal(valid + "height_profile = []\n").find("height_profile is empty"), std::string::npos);
  EXPECT_NE(refusal(valid + "height_profile = [[1, 0], [0, 1]]\n").find("heights that increase"),
            std::string::npos);
  EXPECT_NE(refusal(valid + "noise = { octaves = 17 }\n").find("octaves"), std::string::npos);
  EXPECT_NE(refusal(valid + "noise = { gain = nan }\n").find("gain"), std::string::npos);
  EXPECT_NE(refusal(valid + "sharpness = 0.5\n").find("sharpness"), std::string::npos);
}

TEST(CloudVolume, a_free_form_that_is_not_there_is_an_error_that_names_the_nearest) {
  CloudVolume cloud;
  cloud.bounds = "blub";
  cloud.voxel_size = 0.1;
  try {
    cloud.build({{"blob", FreeForm{}}});
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "error: no free form \"blub\"; expected blob; nearest: blob");
  }
}

}  // namespace
}  // namespace pileus
