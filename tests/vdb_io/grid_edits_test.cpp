#include "vdb_io/openvdb/grid_edits.h"

#include <cmath>
#include <limits>

#include "tests/vdb_io/vdb_test_files.h"

namespace pileus {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;

TEST(CropGrid, keeps_voxels_with_their_centres_in_the_box) {
  for (const double sign : {1.0, -1.0}) {
    auto grid = make_grid();
    grid->tree().fill(openvdb::CoordBBox(Coord(-5), Coord(5)), 1.0f);
    grid->tree().voxelizeActiveTiles();
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    grid->transform().postScale(openvdb::Vec3d(sign, 1, 1));
    crop_grid("a.vdb", *grid, Box3d({-0.3, 0.05, -10}, {0.1, 0.2, 10}));
    EXPECT_EQ(grid->activeVoxelCount(), 5u * 2u * 11u);
    for (auto value = grid->cbeginValueOn(); value; ++value) {
      const openvdb::Vec3d p = grid->indexToWorld(value.getCoord());
      ASSERT_TRUE(p.x() > -0.31 && p.x() < 0.11 && p.y() > 0.04 && p.y() < 0.21) << p;
    }
  }
}

TEST(CropGrid, leaves_nothing_where_the_box_is_elsewhere) {
  auto grid = scattered_voxels();
  crop_grid("a.vdb", *grid, Box3d(Vec3d(1e12), Vec3d(1e13)));
  EXPECT_EQ(grid->activeVoxelCount(), 0u);
  auto between = scattered_voxels();
  crop_grid("a.vdb", *between, Box3d(Vec3d(0.1), Vec3d(0.2)));  // no centre lies there
  EXPECT_EQ(between->activeVoxelCount(), 0u);
}

TEST(CropGrid, refuses_turned_grids) {
  auto grid = scattered_voxels();
  grid->transform().postRotate(0.3, openvdb::math::Y_AXIS);
  expect_mentions(error_of([&] { crop_grid("a.vdb", *grid, Box3d(Vec3d(0), Vec3d(1))); }),
                  "is turned or sheared");
}

TEST(ScaleGrid, widens_space_and_distances) {
  auto fog = scattered_voxels(0.5);
  fog->transform().postTranslate(openvdb::Vec3d(3, 0, 0));
  scale_grid("a.vdb", *fog, 0.01);
  EXPECT_NEAR(fog->indexToWorld(Coord(2, 0, 0)).x(), 0.04, 1e-12);
  EXPECT_EQ(fog->tree().getValue(Coord(16, 0, 0)), 2.0f);
  auto surface = make_grid("surface", openvdb::GRID_LEVEL_SET);
  surface->tree().root().setBackground(1.5f, true);
  surface->tree().setValueOn(Coord(0), -0.5f);
  scale_grid("a.vdb", *surface, 2.0);
  EXPECT_EQ(surface->tree().getValue(Coord(0)), -1.0f);
  EXPECT_EQ(surface->tree().getValue(Coord(1)), 3.0f);
  EXPECT_EQ(surface->background(), 3.0f);
}

TEST(ScaleGrid, refuses_voxels_that_no_file_can_hold) {
  for (const double factor : {1e300, 1e31, 1e-5, 1e-300}) {
    auto fog = scattered_voxels(0.5);
    expect_mentions(error_of([&] { scale_grid("a.vdb", *fog, factor); }), "would get voxels of");
  }
  auto surface = make_grid("surface", openvdb::GRID_LEVEL_SET);
  surface->tree().setValueOn(Coord(0), 1e20f);
  expect_mentions(error_of([&] { scale_grid("a.vdb", *surface, 1e20); }), "too large to be multiplied");
}

TEST(ReplaceNan, finds_them_in_voxels_tiles_and_around) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                  kInf = std::numeric_limits<float>::infinity();
  auto grid = make_grid();
  grid->tree().root().setBackground(kInf, true);
  grid->tree().addTile(1, Coord(0), kNan, true);
  grid->tree().setValueOn(Coord(100, 0, 0), -kInf);
  grid->tree().setValueOff(Coord(101, 0, 0), kNan);
  grid->tree().setValueOn(Coord(102, 0, 0), 4.0f);
  EXPECT_GE(replace_nan("a.vdb", *grid, 0.5), 512u + 2u);
  EXPECT_EQ(grid->background(), 0.5f);
  for (auto value = grid->cbeginValueAll(); value; ++value) ASSERT_TRUE(*value == 0.5f || *value == 4.0f);
  EXPECT_TRUE(grid->tree().isValueOn(Coord(100, 0, 0)));
  EXPECT_FALSE(grid->tree().isValueOn(Coord(101, 0, 0)));
  EXPECT_EQ(replace_nan("a.vdb", *grid, 0.5), 0u);

  auto vectors = make_grid<openvdb::Vec3SGrid>("vel", openvdb::GRID_STAGGERED);
  vectors->tree().setValueOn(Coord(0), openvdb::Vec3s(1, kNan, -2));
  EXPECT_EQ(replace_nan("a.vdb", *vectors, 0), 1u);
  EXPECT_EQ(vectors->tree().getValue(Coord(0)), openvdb::Vec3s(1, 0, -2));
}

TEST(RaiseTo, changes_lower_values_alone) {
  auto grid = make_grid();
  grid->tree().setValueOn(Coord(0), -1.0f);
  grid->tree().setValueOn(Coord(1), 2.0f);
  grid->tree().setValueOn(Coord(2), std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(raise_to("a.vdb", *grid, 0.0), 1u);
  EXPECT_EQ(grid->tree().getValue(Coord(0)), 0.0f);
  EXPECT_EQ(grid->tree().getValue(Coord(1)), 2.0f);
  EXPECT_TRUE(std::isnan(grid->tree().getValue(Coord(2))));
}

TEST(RaiseTo, makes_no_density_of_empty_space) {
  auto grid = make_grid();
  grid->tree().setValueOn(Coord(0), 0.5f);
  grid->tree().setValueOff(Coord(1), 0.25f);
  grid->tree().setValueOff(Coord(2), -1.0f);
  raise_to("a.vdb", *grid, 2.0);
  EXPECT_EQ(grid->tree().getValue(Coord(0)), 2.0f);
  EXPECT_EQ(grid->tree().getValue(Coord(1)), 0.25f);
  EXPECT_EQ(grid->tree().getValue(Coord(2)), 0.0f) << "interpolation reads it, too";
  EXPECT_EQ(grid->background(), 0.0f);
  grid->tree().root().setBackground(-3.0f, true);
  raise_to("a.vdb", *grid, -2.0);
  EXPECT_EQ(grid->background(), -2.0f);
}

TEST(MultiplyValues, takes_all_floating_grids) {
  auto grid = scattered_voxels();
  const float before = grid->tree().getValue(Coord(16, 0, 0));
  multiply_values("a.vdb", *grid, 24.0);
  EXPECT_EQ(grid->tree().getValue(Coord(16, 0, 0)), 24 * before);
  auto vectors = make_grid<openvdb::Vec3SGrid>("vel", openvdb::GRID_STAGGERED);
  vectors->tree().setValueOn(Coord(0), openvdb::Vec3s(1, 0.5f, -2));
  multiply_values("a.vdb", *vectors, -2.0);
  EXPECT_EQ(vectors->tree().getValue(Coord(0)), openvdb::Vec3s(-2, -1, 4));
  expect_mentions(error_of([&] { multiply_values("a.vdb", *grid, 1e38); }), "too large to be multiplied");
  auto flags = make_grid<openvdb::Int32Grid>("flags", openvdb::GRID_UNKNOWN);
  expect_mentions(error_of([&] { multiply_values("a.vdb", *flags, 2); }),
                  "expected floating numbers or vectors");
}

TEST(ChangeBackground, takes_inactive_voxels_along) {
  auto grid = make_grid();
  grid->tree().root().setBackground(0.25f, true);
  grid->tree().setValueOn(Coord(0), 1.0f);
  change_background("a.vdb", *grid, 0.0);
  EXPECT_EQ(grid->background(), 0.0f);
  EXPECT_EQ(grid->tree().getValue(Coord(1)), 0.0f);
  EXPECT_EQ(grid->tree().getValue(Coord(0)), 1.0f);
}

}  // namespace
}  // namespace pileus
