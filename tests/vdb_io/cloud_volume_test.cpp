#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lib/cloud/cloud_presets.h"
#include "lib/core/error.h"
#include "lib/scene/world.h"
#include "tests/fixtures/meshes.h"
#include "tests/fixtures/temp_folder.h"
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

/// A ball of triangles as a file.
void write_ball(const std::filesystem::path& file, bool is_open) {
  MeshData ball = ball_mesh(5, 2.0f, Vec3f(0.0f), 0.0);
  if (is_open) ball.triangles.pop_back();
  std::ofstream stream(file);
  for (const Vec3f& p : ball.vertices) stream << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
  for (const auto& t : ball.triangles)
    stream << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
}

TEST(CloudVolume, fills_a_closed_mesh_as_it_fills_a_free_form) {
  const TempFolder folder;
  write_ball(folder / "ball.obj", false);
  const std::string recipe = "voxel_size = 0.1\nnoise = { octaves = 4, frequency = 0.7 }\n";
  const auto field_of = [&](const std::string& text) {
    const Scene scene =
        parse_scene("pileus = 1\n[camera]\ntype = \"perspective\"\n" + text, "s.toml", folder.path());
    return build_world(scene).media.at(0).density;
  };
  const auto form = field_of(
      "[freeform.ball]\nbase = { sphere = { center = [1, 0, 0], radius = 2 } }\n"
      "[volume.v]\ntype = \"cloud\"\nbounds = \"ball\"\n" +
      recipe);
  const auto mesh = field_of(
      "[volume.v]\ntype = \"cloud\"\nmesh = { file = \"ball.obj\", translate = [1, 0, 0] }\n" + recipe);
  FieldCounters counters;
  double difference = 0.0, all = 0.0;
  for (int n = 0; n < 100; ++n) {
    const Ray ray{{1.0 + 0.33 * (n % 10 - 4.5), -5.0, 0.33 * (n / 10 - 4.5)}, {0, 1, 0}};
    const double expected = form->column(ray, {0, 10}, 1e9, counters);
    difference += std::abs(mesh->column(ray, {0, 10}, 1e9, counters) - expected);
    all += expected;
  }
  EXPECT_GT(all, 20.0);
  EXPECT_LT(difference, 0.02 * all);
}

TEST(CloudVolume, refuses_a_mesh_that_is_open_and_more_than_one_body) {
  const TempFolder folder;
  write_ball(folder / "open.obj", true);
  try {
    const Scene scene = parse_scene(
        "pileus = 1\n[camera]\ntype = \"perspective\"\n[volume.v]\ntype = \"cloud\"\nvoxel_size = 0.1\n"
        "mesh = { file = \"open.obj\" }\n",
        "s.toml", folder.path());
    scene.volumes.at(0).object->build(scene.freeforms);
    FAIL() << "an open mesh has an inside";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::file);
    EXPECT_EQ(error.diagnostics()[0].loc.file, (folder / "open.obj").string());
    EXPECT_NE(error.diagnostics()[0].message.find("the surface is not closed: the edge from ("),
              std::string::npos);
  }
  EXPECT_NE(refusal("bounds = \"blob\"\nvoxel_size = 0.1\nmesh = { file = \"open.obj\" }\n")
                .find("more than one of bounds, size and mesh is given"),
            std::string::npos);
}

/// A solid ball of density 1 with a board of squares as its density.
std::shared_ptr<const DensityField> board_field(const std::string& squares, const std::string& voxels) {
  const Scene scene = parse_scene(
      "pileus = 1\n[camera]\ntype = \"perspective\"\n[light.sun]\ntype = \"sun\"\n"
      "[freeform.ball]\nbase = { sphere = { radius = 2 } }\n"
      "[texture.board]\ntype = \"checker\"\ncolor_b = [0.25, 0.25, 0.25]\n" +
          squares +
          "[volume.v]\ntype = \"cloud\"\nbounds = \"ball\"\nheight_profile = [[0, 1], [1, 1]]\nerosion = 0\n"
          "edge = 0.1\nfalloff = \"hard\"\nthreshold = 0.2\ndensity_texture = \"board\"\n" +
          voxels,
      "s.toml", ".");
  return build_world(scene).media.at(0).density;
}

double density_at(const DensityField& field, const Vec3d& p) {
  double rho = 0.0;
  FieldCounters counters;
  field.sample({p, {1, 0, 0}}, 0.0, 1.0, {&rho, 1}, counters);
  return rho;
}

TEST(CloudVolume, a_texture_is_its_density) {
  // Squares of 1 m in x and z.
  const auto field = board_field("tiles_u = 2\ntiles_v = 2\nscale = [2, 1, 2]\n", "voxel_size = 0.05\n");
  for (const Vec3d& p : {Vec3d(0.5, 0, 0.5), Vec3d(0.5, 1.3, 0.5), Vec3d(-0.5, -1, -0.5)})
    EXPECT_NEAR(density_at(*field, p), density_at(*field, {0.5, 0, 0.5}), 1e-6) << p;
  const double here = density_at(*field, {0.5, 0, 0.5}), beside = density_at(*field, {0.5, 0, -0.5});
  EXPECT_NEAR(std::max(here, beside), 1.0, 1e-6);
  EXPECT_NEAR(std::min(here, beside), 0.25, 1e-6);
  EXPECT_EQ(density_at(*field, {1.9, 1.9, 0}), 0.0) << "outside the ball";
}

TEST(CloudVolume, a_texture_is_averaged_over_voxels_whoever_chooses_their_size) {
  // Squares of 8 mm: ten and more to a voxel.
  const std::string squares = "tiles_u = 2\ntiles_v = 2\nscale = [0.016, 1, 0.016]\n";
  for (const char* voxels : {"voxel_size = 0.1\n", "max_voxels = 60000\n"}) {
    const auto field = board_field(squares, voxels);
    for (int n = 0; n < 50; ++n)
      ASSERT_NEAR(density_at(*field, {0.037 * n - 0.9, 0.01 * n, 0.5 - 0.023 * n}), 0.625, 0.03)
          << voxels << n;
  }
}

TEST(CloudVolume, a_density_texture_that_is_not_there_is_an_error_that_names_the_nearest) {
  try {
    parse_scene(
        "pileus = 1\n[camera]\ntype = \"perspective\"\n[texture.board]\ntype = \"checker\"\n"
        "[volume.v]\ntype = \"cloud\"\nsize = [1, 1, 1]\nvoxel_size = 0.1\ndensity_texture = \"bord\"\n",
        "s.toml", ".");
    FAIL() << "there is no such texture";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("board"), std::string::npos) << error.what();
    EXPECT_EQ(error.diagnostics()[0].loc.line, 10);
  }
}

}  // namespace
}  // namespace pileus
