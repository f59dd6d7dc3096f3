#include "vdb_io/openvdb/vdb_writer.h"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "lib/core/version.h"
#include "tests/fixtures/temp_folder.h"
#include "tests/vdb_io/vdb_test_files.h"
#include "vdb_io/openvdb/vdb_reader.h"
#include "vdb_io/vdb_directory.h"

namespace pileus {
namespace {

using openvdb::Coord;

class Writer : public testing::Test {
 protected:
  TempFolder folder;
  std::filesystem::path path = folder / "cloud.vdb";

  static openvdb::FloatGrid::Ptr random_grid(const std::string& name = "density") {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> value(0.0f, 4.0f);
    std::uniform_int_distribution<int> place(-40, 40);
    auto grid = make_grid(name);
    for (int i = 0; i < 2000; ++i)
      grid->tree().setValueOn(Coord(place(random), place(random), place(random)), value(random));
    grid->tree().addTile(1, Coord(64), 2.5f, true);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
    return grid;
  }

  void write(const openvdb::FloatGrid::ConstPtr& grid, const VdbWriteOptions& options = {}) {
    write_vdb(path, {&grid, 1}, options);
  }
};

TEST_F(Writer, values_come_back_equal) {
  const auto grid = random_grid();
  for (const VdbCodec codec : {VdbCodec::none, VdbCodec::blosc}) {
    write(grid, {.codec = codec});
    const auto back = read_density_grid(path).grid;
    EXPECT_EQ(back->activeVoxelCount(), grid->activeVoxelCount());
    EXPECT_EQ(back->transform(), grid->transform());
    for (auto value = grid->cbeginValueOn(); value; ++value) {
      ASSERT_EQ(back->tree().getValue(value.getCoord()), *value);
    }
  }
}

TEST_F(Writer, halves_lie_within_half_an_ulp) {
  const auto grid = random_grid();
  write(grid, {.half = true});
  const auto back = read_density_grid(path).grid;
  for (auto value = grid->cbeginValueOn(); value; ++value) {
    const float ulp = std::ldexp(1.0f, std::max(std::ilogb(*value), -14) - 10);
    ASSERT_NEAR(back->tree().getValue(value.getCoord()), *value, 0.5f * ulp);
  }
}

TEST_F(Writer, refuses_what_half_cannot_hold) {
  auto grid = make_grid();
  grid->tree().setValueOn(Coord(0), 1e5f);
  expect_mentions(error_of([&] { write(grid, {.half = true}); }), "holds 100000, which half floats cannot");
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(Writer, follows_the_conventions_of_the_field) {
  auto grid = random_grid();
  grid->setGridClass(openvdb::GRID_UNKNOWN);
  write(grid, {.half = true});
  const VdbDirectory directory = read_vdb_directory(path);
  EXPECT_EQ(directory.metadata.at("creator"), fmt::format("pileus {}", kVersion));
  ASSERT_EQ(directory.grids.size(), 1u);
  const VdbGridEntry& entry = directory.grids.front();
  EXPECT_EQ(entry.name, "density");
  EXPECT_EQ(entry.grid_class, "fog volume");
  EXPECT_TRUE(entry.saved_as_half);
  EXPECT_EQ(entry.compression, 6u);  // active mask and blosc
  EXPECT_EQ(entry.metadata.at("file_voxel_count"), std::to_string(grid->activeVoxelCount()));
  EXPECT_TRUE(entry.metadata.contains("file_bbox_min"));
  EXPECT_EQ(grid->getGridClass(), openvdb::GRID_UNKNOWN) << "the caller's grid was modified";
}

TEST_F(Writer, same_grid_gives_same_bytes) {
  write(random_grid());
  const std::string first = read_bytes(path);
  write(random_grid());
  EXPECT_EQ(read_bytes(path), first);
  auto other = random_grid();
  other->tree().setValueOn(Coord(0), 3.0f);
  write(other);
  EXPECT_NE(read_bytes(path).substr(21, 36), first.substr(21, 36)) << "the id does not follow the content";
}

TEST_F(Writer, writes_several_grids) {
  const std::vector<openvdb::FloatGrid::ConstPtr> grids{random_grid("density"), random_grid("heat")};
  write_vdb(path, grids);
  EXPECT_EQ(read_density_grid(path, {.grid = "heat"}).grid->activeVoxelCount(), grids[1]->activeVoxelCount());
  const std::vector<openvdb::FloatGrid::ConstPtr> twins{random_grid("a"), random_grid("a")};
  expect_mentions(error_of([&] { write_vdb(path, twins); }), "two grids are called \"a\"");
}

TEST_F(Writer, refuses_grids_that_are_no_fog_volumes) {
  auto nameless = make_grid("");
  expect_mentions(error_of([&] { write(nameless); }), "has no name");
  auto infinite = make_grid();
  infinite->tree().setValueOn(Coord(0), std::numeric_limits<float>::infinity());
  expect_mentions(error_of([&] { write(infinite); }), "0 NaN and 1 infinite values");
  auto filled = openvdb::FloatGrid::create(1.0f);
  filled->setName("density");
  expect_mentions(error_of([&] { write(filled); }), "has the background 1");
}

TEST_F(Writer, leaves_nothing_behind_where_it_fails) {
  path = folder.path() / "no" / "such" / "folder.vdb";
  EXPECT_NE(error_of([&] { write(random_grid()); }), "");
  EXPECT_EQ(folder.file_count(), 0u);
}

}  // namespace
}  // namespace pileus
