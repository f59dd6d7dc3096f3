#include "vdb_io/openvdb/vdb_reader.h"

#include <cmath>
#include <limits>

#include "lib/math/vec.h"
#include "tests/fixtures/temp_folder.h"
#include "tests/vdb_io/vdb_test_files.h"

namespace pileus {
namespace {

using openvdb::Coord;

struct RealFile {
  const char* file;
  const char* grid;
  Vec3i dims;
  uint64_t active;
  double min, max, voxel;
};

void PrintTo(const RealFile& real, std::ostream* out) {
  *out << real.file;
}

class ReadRealFile : public testing::TestWithParam<RealFile> {};

// Figures of the data's own README, to the digits it gives.
TEST_P(ReadRealFile, has_the_known_figures) {
  const RealFile& known = GetParam();
  PILEUS_REAL_FILE(path, known.file);
  const DensityGrid density = read_density_grid(path);
  EXPECT_EQ(density.source.name, known.grid);
  EXPECT_EQ(density.grid->activeVoxelCount(), known.active);
  const Coord dims = density.grid->evalActiveVoxelDim();
  EXPECT_EQ(Vec3i(dims.x(), dims.y(), dims.z()), known.dims);
  EXPECT_NEAR(density.values.min, known.min, 0.05 * std::abs(known.min));
  EXPECT_NEAR(density.values.max, known.max, 1e-3 * known.max);
  EXPECT_NEAR(density.grid->voxelSize().x(), known.voxel, 1e-3);
  EXPECT_EQ(density.values.bad(), 0u);
}

INSTANTIATE_TEST_SUITE_P(
    Data, ReadRealFile,
    testing::Values(RealFile{"vdb/smoke1.vdb", "density", {111, 222, 112}, 1049275, 1.0e-5, 5.715, 0.476},
                    RealFile{"vdb/dragon.vdb", "density", {70, 49, 31}, 19660, 2.9e-5, 1.0, 0.1},
                    RealFile{"vdb/houdini_sphere_density.vdb", "density", {25, 25, 25}, 9047, 0.0, 1.0, 0.1},
                    RealFile{"vdb/torus01.vdb", "voxel_fog_density", {22, 9, 22}, 2450, 0.027, 100.0, 0.403},
                    RealFile{
                        "vdb/wdas_cloud_sixteenth.vdb", "density", {126, 86, 154}, 415642, 0.0, 1.0, 3.333},
                    RealFile{"vdb/blender_gas_0010.vdb", "density", {51, 71, 29}, 39375, 1e-6, 1.0, 0.8}));

TEST(ReadDensity, reads_both_codecs_of_the_gas_cache) {
  PILEUS_REAL_FILE(path, "vdb/blender_gas_0001_zip.vdb");
  EXPECT_GT(read_density_grid(path).grid->activeVoxelCount(), 0u);
}

TEST(ReadDensity, refuses_the_empty_grids_of_the_gas_cache) {
  PILEUS_REAL_FILE(path, "vdb/blender_gas_0010.vdb");
  for (const char* grid : {"flame", "fuel", "react"}) {
    expect_mentions(error_of([&] { read_density_grid(path, {.grid = grid}); }), "is empty (0 active voxels)");
  }
}

TEST(ReadDensity, refuses_vectors_and_points) {
  PILEUS_REAL_FILE(gas, "vdb/blender_gas_0010.vdb");
  expect_mentions(error_of([&] { read_density_grid(gas, {.grid = "velocity"}); }), "holds vectors (vec3s");
  PILEUS_REAL_FILE(points, "vdb/points.vdb");
  expect_mentions(error_of([&] { read_density_grid(points); }), "holds points, not a volume");
}

TEST(ReadDensity, reads_whole_numbers_of_the_gas_cache) {
  PILEUS_REAL_FILE(path, "vdb/blender_gas_0010.vdb");
  const DensityGrid flags = read_density_grid(path, {.grid = "flags", .bad_values = BadValuePolicy::to_zero});
  EXPECT_EQ(flags.source.value_type, "int32");
  EXPECT_EQ(flags.values.max, std::round(flags.values.max));
}

TEST(ReadDensity, fills_a_level_set_on_request_only) {
  PILEUS_REAL_FILE(path, "vdb/sphere_levelset.vdb");
  expect_mentions(error_of([&] { read_density_grid(path); }), "write `level_set = \"fog\"`");
  const DensityGrid fog = read_density_grid(path, {.level_set = LevelSetPolicy::to_fog});
  EXPECT_EQ(fog.values.max, 1.0);
  EXPECT_GE(fog.values.min, 0.0);
  EXPECT_EQ(fog.grid->background(), 0.0f);
  // The active voxels are those inside: the sphere has a radius of 60 voxels (and its band 3 on either side).
  const double volume = 4.0 / 3.0 * M_PI * std::pow(60.0, 3);
  EXPECT_NEAR(double(fog.grid->activeVoxelCount()), volume, 0.002 * volume);
}

TEST(ReadDensity, fills_level_sets_without_a_narrow_band) {
  PILEUS_REAL_FILE(path, "vdb/blender_gas_0010.vdb");  // background 0, and 10000 for "far"
  const DensityGrid fog =
      read_density_grid(path, {.grid = "phi_obstacle", .level_set = LevelSetPolicy::to_fog});
  EXPECT_EQ(fog.grid->activeVoxelCount(), 65107u);  // its negative distances
  EXPECT_LE(fog.values.max, 1.0);
  expect_mentions(
      error_of([&] { read_density_grid(path, {.grid = "phi_out", .level_set = LevelSetPolicy::to_fog}); }),
      "is empty");
}

class Reader : public testing::Test {
 protected:
  TempFolder folder;
  std::filesystem::path path = folder / "a.vdb";
};

template <class Grid>
void expect_value_becomes(const std::filesystem::path& path, typename Grid::ValueType value, float expected) {
  auto grid = make_grid<Grid>();
  grid->tree().setValueOn(Coord(-3, 5, 900), value);
  write_with_openvdb(path, {grid});
  const DensityGrid density = read_density_grid(path);
  EXPECT_EQ(density.grid->tree().getValue(Coord(-3, 5, 900)), expected);
  EXPECT_EQ(density.grid->activeVoxelCount(), 1u);
}

TEST_F(Reader, every_scalar_type_becomes_float) {
  expect_value_becomes<openvdb::FloatGrid>(path, 0.75f, 0.75f);
  expect_value_becomes<openvdb::DoubleGrid>(path, 1.0 / 3.0, float(1.0 / 3.0));
  expect_value_becomes<openvdb::Int32Grid>(path, 7, 7.0f);
  expect_value_becomes<openvdb::Int64Grid>(path, int64_t(1) << 40, float(int64_t(1) << 40));
  expect_value_becomes<openvdb::BoolGrid>(path, true, 1.0f);
}

TEST_F(Reader, says_what_it_converted) {
  auto grid = make_grid<openvdb::DoubleGrid>("rho", openvdb::GRID_UNKNOWN);
  grid->tree().setValueOn(Coord(0), 1.0);
  write_with_openvdb(path, {grid});
  const DensityGrid density = read_density_grid(path);
  ASSERT_EQ(density.notes.size(), 2u);
  EXPECT_EQ(density.notes[0], "grid \"rho\" converted from double to float");
  EXPECT_EQ(density.notes[1], "grid \"rho\" has no class; taken as a fog volume");
}

openvdb::GridBase::Ptr one_voxel(const std::string& name, float value = 1.0f) {
  auto grid = make_grid(name);
  grid->tree().setValueOn(Coord(0), value);
  return grid;
}

TEST_F(Reader, prefers_density_and_reports_the_choice) {
  write_with_openvdb(path, {one_voxel("heat"), one_voxel("density", 0.5f)});
  const DensityGrid density = read_density_grid(path);
  EXPECT_EQ(density.values.max, 0.5);
  ASSERT_EQ(density.notes.size(), 1u);
  EXPECT_EQ(density.notes[0], "grid density (float, fog volume) chosen among 2");
}

TEST_F(Reader, takes_the_only_fog_volume) {
  auto level_set = make_grid("surface", openvdb::GRID_LEVEL_SET);
  write_with_openvdb(path, {level_set, one_voxel("soot")});
  EXPECT_EQ(read_density_grid(path).source.name, "soot");
}

TEST_F(Reader, lists_candidates_where_it_cannot_choose) {
  write_with_openvdb(path, {one_voxel("heat"), one_voxel("ash")});
  const std::string message = error_of([&] { read_density_grid(path); });
  expect_mentions(message, "heat (float, fog volume), ash (float, fog volume)");
  expect_mentions(message, "choose with `grid = \"...\"`");
}

TEST_F(Reader, names_the_nearest_grid) {
  write_with_openvdb(path, {one_voxel("density"), one_voxel("heat")});
  EXPECT_EQ(error_of([&] { read_density_grid(path, {.grid = "densty"}); }),
            path.string() +
                ": error: no grid \"densty\"; found density (float, fog volume), heat (float, fog "
                "volume); nearest: density");
}

TEST_F(Reader, tells_grids_of_one_name_apart_by_number) {
  write_with_openvdb(path, {one_voxel("density", 1.0f), one_voxel("density", 2.0f)});
  EXPECT_EQ(read_density_grid(path, {.grid = "density[0]"}).values.max, 1.0);
  EXPECT_EQ(read_density_grid(path, {.grid = "density[1]"}).values.max, 2.0);
  expect_mentions(error_of([&] { read_density_grid(path, {.grid = "density"}); }), "density[0]");
}

TEST_F(Reader, reads_a_tree_shared_by_two_grids) {
  auto first = make_grid("first");
  first->tree().setValueOn(Coord(4), 0.25f);
  auto second = first->copy();
  second->setName("second");
  write_with_openvdb(path, {first, second});
  EXPECT_EQ(read_density_grid(path, {.grid = "second"}).grid->tree().getValue(Coord(4)), 0.25f);
}

TEST_F(Reader, refuses_a_frustum) {
  auto grid = make_grid();
  grid->tree().setValueOn(Coord(0), 1.0f);
  grid->setTransform(openvdb::math::Transform::createFrustumTransform(openvdb::BBoxd({0, 0, 0}, {10, 10, 10}),
                                                                      0.5, 10.0, 1.0));
  write_with_openvdb(path, {grid});
  expect_mentions(error_of([&] { read_density_grid(path); }), "NonlinearFrustumMap (a frustum");
}

TEST_F(Reader, keeps_rotated_and_uneven_transforms_exactly) {
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  matrix.preRotate(openvdb::math::X_AXIS, 0.3);
  matrix.preRotate(openvdb::math::Z_AXIS, -1.1);
  matrix.preScale(openvdb::Vec3d(0.1, 0.37, 2.5));
  matrix.setTranslation(openvdb::Vec3d(1e6 + 0.1, -3.0, 1.0 / 3.0));
  auto grid = make_grid();
  grid->tree().setValueOn(Coord(0), 1.0f);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  write_with_openvdb(path, {grid});
  const Affine map = world_from_index(path, *read_density_grid(path).grid);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) EXPECT_EQ(map.matrix()[i][j], matrix[i][j]);
  }
  const openvdb::Vec3d there = grid->indexToWorld(openvdb::Vec3d(3.5, -2.0, 11.0));
  EXPECT_LT((map.point({3.5, -2.0, 11.0}) - Vec3d(there.x(), there.y(), there.z())).length(), 1e-9);
}

TEST_F(Reader, refuses_bad_values_with_their_counts) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  auto grid = make_grid();
  grid->tree().setValueOn(Coord(0), 2.0f);
  grid->tree().setValueOn(Coord(1), nan);
  grid->tree().setValueOn(Coord(2), -infinity);
  grid->tree().setValueOff(Coord(3), -1.0f);
  grid->tree().setValueOn(Coord(100), -1.0f);
  write_with_openvdb(path, {grid});
  const std::string message = error_of([&] { read_density_grid(path); });
  expect_mentions(message, "holds 1 NaN, 1 infinite and 2 negative values");
  expect_mentions(message, "`nan = \"zero\"`");

  const DensityGrid cleared = read_density_grid(path, {.bad_values = BadValuePolicy::to_zero});
  EXPECT_EQ(cleared.values.bad(), 4u);
  EXPECT_EQ(count_values(*cleared.grid).bad(), 0u);
  EXPECT_EQ(cleared.grid->tree().getValue(Coord(0)), 2.0f);
  EXPECT_EQ(cleared.grid->tree().getValue(Coord(1)), 0.0f);
  EXPECT_EQ(cleared.notes.back(), "grid \"density\": 1 NaN, 1 infinite and 2 negative values set to 0");
}

TEST_F(Reader, clears_bad_tiles) {
  auto grid = make_grid();
  grid->tree().addTile(1, Coord(0), -1.0f, true);
  grid->tree().setValueOn(Coord(-1), 1.0f);
  write_with_openvdb(path, {grid});
  const DensityGrid cleared = read_density_grid(path, {.bad_values = BadValuePolicy::to_zero});
  EXPECT_EQ(cleared.values.negative, 512u);
  EXPECT_EQ(cleared.grid->tree().getValue(Coord(3)), 0.0f);
}

TEST_F(Reader, keeps_inactive_values) {
  auto grid = make_grid();
  grid->tree().setValueOn(Coord(0), 1.0f);
  grid->tree().setValueOff(Coord(1), 0.5f);
  write_with_openvdb(path, {grid});
  const DensityGrid density = read_density_grid(path);
  EXPECT_EQ(density.grid->tree().getValue(Coord(1)), 0.5f);
  EXPECT_EQ(density.values.inactive_nonzero, 1u);
}

TEST_F(Reader, refuses_a_background_that_fills_space) {
  auto grid = openvdb::FloatGrid::create(0.5f);
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->tree().setValueOn(Coord(0), 1.0f);
  write_with_openvdb(path, {grid});
  expect_mentions(error_of([&] { read_density_grid(path); }),
                  "has the background 0.5, which fills all of space");
}

}  // namespace
}  // namespace pileus
