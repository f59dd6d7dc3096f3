#include "vdb_io/inspect.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/fixtures/temp_folder.h"
#include "tests/vdb_io/vdb_test_files.h"
#include "vdb_io/vdb_summary.h"

namespace pileus {
namespace {

using openvdb::Coord;

const GridReport& find(const VdbReport& report, const std::string& name) {
  const auto found = std::find_if(report.grids.begin(), report.grids.end(),
                                  [&](const GridReport& grid) { return grid.entry.name == name; });
  if (found == report.grids.end()) throw std::runtime_error("no grid " + name);
  return *found;
}

/// What the inspection complains about, for one grid or ("") for the file as a whole.
std::string complaints(const VdbReport& report, const std::string& grid = "") {
  std::string text;
  for (const Finding& finding : report.findings) {
    if (finding.grid == grid) text += finding.message + "; " + finding.scene + "\n";
  }
  return text;
}

TEST(Inspect, lists_all_grids_of_a_gas_cache) {
  PILEUS_REAL_FILE(path, "vdb/blender_gas_0010.vdb");
  const VdbReport report = inspect_vdb(path);
  EXPECT_EQ(report.grids.size(), 24u);
  EXPECT_EQ(report.default_grid, "density");
  EXPECT_EQ(report.directory.file_version, 224u);
  for (const GridReport& grid : report.grids) EXPECT_EQ(grid.problem, "") << grid.entry.name;

  const GridReport& density = find(report, "density");
  EXPECT_EQ(density.structure->active_voxels, 39375u);
  EXPECT_EQ(density.structure->active_bounds.size() + Vec3i(1), Vec3i(51, 71, 29));
  EXPECT_NEAR(density.voxel_size->x, 0.8, 1e-6);
  EXPECT_EQ(density.entry.compression, 4u);
  expect_mentions(complaints(report, "flame"), "is empty (0 active voxels");
  expect_mentions(complaints(report, "velocity"), "holds vec3s values");
  EXPECT_GT(find(report, "velocity").structure->active_voxels, 0u);
}

TEST(Inspect, knows_the_points_and_the_level_set) {
  PILEUS_REAL_FILE(points, "vdb/points.vdb");
  expect_mentions(complaints(inspect_vdb(points), "points"), "holds points");
  PILEUS_REAL_FILE(sphere, "vdb/sphere_levelset.vdb");
  const VdbReport report = inspect_vdb(sphere);
  const GridReport& level_set = report.grids.at(0);
  EXPECT_EQ(level_set.structure->active_voxels, 270638u);
  EXPECT_NEAR(level_set.values->min, -0.1495, 1e-3);
  expect_mentions(complaints(report, "ls_sphere"), "level_set = \"fog\"");
  EXPECT_FALSE(level_set.values->max_column);
}

class InspectFile : public testing::Test {
 protected:
  TempFolder folder;
  std::filesystem::path path = folder / "a.vdb";
};

TEST_F(InspectFile, counts_in_the_file_equal_the_trees) {
  auto grid = make_grid();
  grid->tree().addTile(1, Coord(-16), 1.0f, true);
  grid->tree().addTile(2, Coord(256, 0, 0), 1.0f, true);
  for (int i = -50; i < 50; ++i) grid->tree().setValueOn(Coord(i, 3 * i, i * i), 1.0f);
  write_with_openvdb(path, {grid});
  const GridStructure structure = *inspect_vdb(path).grids.at(0).structure;
  EXPECT_EQ(structure.active_voxels, grid->activeVoxelCount());
  EXPECT_EQ(structure.active_tiles, grid->tree().activeTileCount());
  EXPECT_EQ(structure.leaves, grid->tree().leafCount());
  EXPECT_EQ(structure.internal_nodes, grid->tree().nonLeafCount() - 1);
  const auto box = grid->evalActiveVoxelBoundingBox();
  EXPECT_EQ(structure.active_bounds.min, Vec3i(box.min().x(), box.min().y(), box.min().z()));
  EXPECT_EQ(structure.active_bounds.max, Vec3i(box.max().x(), box.max().y(), box.max().z()));
}

TEST_F(InspectFile, longest_column_is_a_sum_times_the_voxel) {
  // 10 voxels of density 3 along z, 0.2 m apart, beside a tile of 8 voxels of density 1.
  auto grid = make_grid();
  for (int z = 0; z < 10; ++z) grid->tree().setValueOn(Coord(0, 0, 100 + z), 3.0f);
  grid->tree().addTile(1, Coord(16), 1.0f, true);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.2));
  write_with_openvdb(path, {grid});
  EXPECT_NEAR(*inspect_vdb(path).grids.at(0).values->max_column, 10 * 3.0 * 0.2, 1e-9);
}

TEST_F(InspectFile, bad_values_get_a_warning_with_the_fix) {
  auto grid = make_grid();
  grid->tree().setValueOn(Coord(0), std::numeric_limits<float>::quiet_NaN());
  grid->tree().setValueOn(Coord(1), -1.0f);
  write_with_openvdb(path, {grid});
  const VdbReport report = inspect_vdb(path);
  EXPECT_EQ(report.grids.at(0).values->nan, 1u);
  EXPECT_EQ(report.grids.at(0).values->negative, 1u);
  expect_mentions(complaints(report, "density"), "nan = \"zero\"");
}

TEST_F(InspectFile, an_undecided_file_says_so) {
  auto heat = make_grid("heat"), ash = make_grid("ash");
  heat->tree().setValueOn(Coord(0), 1.0f);
  ash->tree().setValueOn(Coord(0), 1.0f);
  write_with_openvdb(path, {heat, ash});
  const VdbReport report = inspect_vdb(path);
  EXPECT_EQ(report.default_grid, "");
  expect_mentions(complaints(report), "grid = \"heat\"");
  EXPECT_EQ(inspect_vdb(path, "ash").grids.size(), 1u);
  expect_mentions(error_of([&] { inspect_vdb(path, "asj"); }), "nearest: ash");
}

TEST_F(InspectFile, suspicious_sizes_get_a_scale) {
  auto grid = make_grid();
  grid->tree().setValueOn(Coord(0), 1.0f);
  grid->tree().setValueOn(Coord(99, 0, 0), 1.0f);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(5e-5));
  write_with_openvdb(path, {grid});
  expect_mentions(complaints(inspect_vdb(path), "density"), "scale = [2000, 2000, 2000]");
}

TEST_F(InspectFile, summary_frames_a_slab) {
  // 4 x 5 x 6 voxels of density 2, half a metre wide.
  auto grid = make_grid();
  grid->tree().fill(openvdb::CoordBBox(Coord(0), Coord(3, 4, 5)), 2.0f, true);
  auto transform = openvdb::math::Transform::createLinearTransform(0.5);
  transform->postTranslate(openvdb::Vec3d(10, 0, 0));
  grid->setTransform(transform);
  write_with_openvdb(path, {grid});
  const GridSummary summary = summarize_density(path, "");
  EXPECT_EQ(summary.grid, "density");
  EXPECT_LT((summary.bounds.min - Vec3d(9.75, -0.25, -0.25)).length(), 1e-12);
  EXPECT_LT((summary.bounds.max - Vec3d(11.75, 2.25, 2.75)).length(), 1e-12);
  EXPECT_EQ(summary.voxel_size, Vec3d(0.5));
  EXPECT_EQ(summary.max_density, 2.0);
  EXPECT_NEAR(summary.typical_column, (4 + 5 + 6) / 3.0 * 0.5 * 2.0, 1e-12);
}

}  // namespace
}  // namespace pileus
