// The object "terrain": where rays meet it, its holes, where it is put, bad files.
#include <cmath>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/scene/scene.h"
#include "lib/scene/world.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

/// A scene with a terrain of 4 x 3 nodes, 10 m apart: rises 1 m per node to the east; one node has no data.
class TerrainScene {
 public:
  explicit TerrainScene(const std::string& table = "0 1 2 3\n0 1 2 3\n0 1 2 -9999\n") {
    std::ofstream(m_folder / "land.asc")
        << "ncols 4\nnrows 3\nxllcorner 5000\nyllcorner 5000\ncellsize 10\nNODATA_value -9999\n"
        << table;
  }

  World build(const std::string& more = "", const std::string& others = "") const {
    return build_world(parse_scene("pileus = 1\n[camera]\ntype = \"perspective\"\nposition = [0, 0, 9]\n" +
                                       others + "[object.land]\ntype = \"terrain\"\nfile = \"land.asc\"\n" +
                                       more,
                                   "s.toml", m_folder.path()));
  }

  std::string problem(const std::string& more = "") const {
    try {
      build(more);
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  }

 private:
  TempFolder m_folder;
};

/// The hit of a ray that falls straight down.
std::optional<WorldHit> fall(const World& world, double x, double z) {
  return nearest_surface(world, {{x, 100, z}, {0, -1, 0}}, {0, kInf});
}

TEST(TerrainObject, has_its_middle_at_the_origin_and_goes_east_and_south) {
  const World world = TerrainScene().build();
  const auto middle = fall(world, 0, -1);
  ASSERT_TRUE(middle);
  EXPECT_NEAR(100 - middle->t, 1.5, 1e-12);
  EXPECT_LT((middle->n - normalize(Vec3d(-0.1, 1, 0))).length(), 1e-12);
  EXPECT_NEAR(100 - fall(world, 10, -9)->t, 2.5, 1e-12);
  EXPECT_FALSE(fall(world, 16, 0)) << "beyond the east edge";
  EXPECT_FALSE(fall(world, 0, -11));
  const auto below = nearest_surface(world, {{0, -50, -1}, {0, 1, 0}}, {0, kInf});
  ASSERT_TRUE(below);
  EXPECT_LT(below->n.y, 0) << "seen from below, too";
}

TEST(TerrainObject, has_a_hole_where_a_height_is_missing) {
  const World world = TerrainScene().build();
  EXPECT_FALSE(fall(world, 10, 5)) << "the cell in the south-east";
  EXPECT_TRUE(fall(world, 10, -5));
  EXPECT_TRUE(fall(world, 4.9, 5));
  EXPECT_FALSE(is_occluded(world, {{10, -5, 5}, {0, 1, 0}}, {0, kInf})) << "light falls through";
}

TEST(TerrainObject, leaves_out_what_is_lower_than_the_threshold) {
  const World world = TerrainScene().build("threshold = 0.5\n");
  EXPECT_FALSE(fall(world, -12, -5));
  EXPECT_TRUE(fall(world, -8, -5));
}

TEST(TerrainObject, lies_under_water) {
  const World world = TerrainScene().build("", "[object.lake]\ntype = \"plane\"\npoint = [0, 1.2, 0]\n");
  EXPECT_NEAR(100 - fall(world, -10, -5)->t, 1.2, 1e-12) << "the lake";
  EXPECT_NEAR(100 - fall(world, 10, -5)->t, 2.5, 1e-12) << "the shore";
}

TEST(TerrainObject, is_scaled_turned_and_moved) {
  const World world =
      TerrainScene().build("scale = [2, 3, 2]\nrotate_deg = [0, 90, 0]\ntranslate = [100, 5, 0]\n");
  // A quarter turn about y takes east (+x) to north (-z).
  const auto hit = fall(world, 98, -10);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(100 - hit->t, 5 + 3 * 2.0, 1e-9);
  EXPECT_LT((hit->n - normalize(Vec3d(0, 1, 3 * 0.1 / 2))).length(), 1e-12);
  EXPECT_FALSE(fall(world, 0, 0));
  EXPECT_TRUE(world.shapes[0]->bounds().intersects(Vec3d(98, 11, -10)));
}

TEST(TerrainObject, is_smooth_where_it_is_asked_for) {
  const TerrainScene ridge("0 1 1 0\n0 1 1 0\n0 1 1 0\n");
  EXPECT_NEAR(100 - fall(ridge.build(), 0, -1)->t, 1.0, 1e-12);
  EXPECT_NEAR(100 - fall(ridge.build("interpolation = \"bicubic\"\n"), 0, -1)->t, 1.125, 1e-12);
  EXPECT_NE(ridge.problem("interpolation = \"cubic\"\n").find("bilinear"), std::string::npos);
}

/// A bump of 0.375 m in a plain that a pixel of 1 m may ignore, where half a pixel is allowed.
TEST(TerrainObject, leaves_out_what_is_a_small_part_of_a_pixel) {
  const TerrainScene bump("0 0 0 0\n0 0.375 0 0\n0 0 0 0\n");
  const Ray ray{{-5, 100, 0}, {0, -1, 0}};
  const auto height = [&](const World& world, double width) {
    const auto hit = nearest_surface(world, ray, {0, kInf}, {0.0, width, 0.0});
    return hit ? 100.0 - hit->t : kInf;
  };
  const World exact = bump.build(), coarse = bump.build("level_of_detail = 0.5\n");
  EXPECT_NEAR(height(exact, 1.0), 0.375, 1e-12) << "not asked for";
  EXPECT_NEAR(height(coarse, 0.5), 0.375, 1e-12) << "a quarter of a metre is allowed";
  EXPECT_NEAR(height(coarse, 1.0), 0.0, 1e-12);
  const auto hit = nearest_surface(coarse, ray, {0, kInf}, {0.0, 1.0, 0.0});
  EXPECT_GE(hit->error, 0.375) << "shadow rays start off the surface as it is";
  EXPECT_NE(bump.problem("level_of_detail = -1\n").find("out of range"), std::string::npos);
}

TEST(TerrainObject, refuses_bad_files) {
  EXPECT_EQ(TerrainScene().problem(), "none");
  EXPECT_NE(TerrainScene("0 1 2\n").problem(), "none") << "too few heights";
  EXPECT_NE(
      TerrainScene("-9999 -9999 -9999 -9999\n-9999 -9999 -9999 -9999\n-9999 -9999 -9999 -9999\n").problem(),
      "none")
      << "none at all";
  EXPECT_NE(TerrainScene("a b c d\n").problem(), "none");
  EXPECT_NE(TerrainScene().problem("scale = [1, 0, 1]\n").find("out of range"), std::string::npos);
  EXPECT_NE(TerrainScene().problem("cell_size = -1\n").find("out of range"), std::string::npos);
}

}  // namespace
}  // namespace pileus
