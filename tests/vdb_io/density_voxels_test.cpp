// What a volume of a scene is made of when its file is read directly: the same as by way of OpenVDB, down to
// the notes, the errors and the bits of the bricks.
#include "vdb_io/density_voxels.h"

#include <algorithm>
#include <cstring>

#include "lib/volume/brick_grid.h"
#include "tests/fixtures/temp_folder.h"
#include "tests/vdb_io/random_trees.h"
#include "tests/vdb_io/vdb_test_files.h"
#include "vdb_io/openvdb/grid_to_field.h"
#include "vdb_io/openvdb/vdb_reader.h"

namespace pileus {
namespace {

using openvdb::Coord;

bool same_range(const ValueRange& a, const ValueRange& b) {
  return a.lo == b.lo && a.hi == b.hi;
}

/// Same bricks at the same places with the same bits.
void expect_same_bricks(const BrickGrid& a, const BrickGrid& b) {
  EXPECT_EQ(a.lo(), b.lo());
  EXPECT_EQ(a.hi(), b.hi());
  ASSERT_EQ(a.all_values().size(), b.all_values().size());
  EXPECT_EQ(std::memcmp(a.all_values().data(), b.all_values().data(), a.all_values().size_bytes()), 0);
  ASSERT_EQ(a.blocks().size(), b.blocks().size());
  for (size_t i = 0; i < a.blocks().size(); ++i) {
    ASSERT_EQ(a.blocks()[i].origin, b.blocks()[i].origin);
    for (int n = 0; n < 4096; ++n) {
      const Vec3i cell = a.blocks()[i].origin + 8 * Vec3i(n >> 8, n >> 4 & 15, n & 15);
      const BrickGrid::Brick &here = a.brick_at(a.blocks()[i], cell),
                             &there = b.brick_at(b.blocks()[i], cell);
      ASSERT_EQ(here.slot, there.slot);
      ASSERT_TRUE(same_range(here.range, there.range));
    }
  }
}

/// Both ways of reading say the same of a file, and make the same field of it where they make one.
///   returns: true where there is a density
bool expect_same_density(const std::filesystem::path& path, const VdbReadOptions& options) {
  DensityVoxels direct;
  DensityGrid twin;
  const std::string error = error_of([&] { direct = read_density_voxels(path, options); });
  EXPECT_EQ(error, error_of([&] { twin = read_density_grid(path, options); }));
  if (!error.empty()) return false;
  EXPECT_EQ(direct.notes, twin.notes);
  EXPECT_EQ(direct.source.name, twin.source.name);
  EXPECT_EQ(direct.voxels.counts, twin.values);
  EXPECT_EQ(direct.voxels.active_voxels, twin.grid->activeVoxelCount());
  const Affine placement = Affine::translation({10, 0, 0}) * Affine::scaling({2, 1, 1});
  const auto field = field_from_voxels(direct.voxels, placement),
             other = field_from_grid(twin.grid, placement);
  EXPECT_EQ(field->index_from_world().matrix(), other->index_from_world().matrix());
  EXPECT_EQ(field->max_density(), other->max_density());
  EXPECT_EQ(field->bounds(), other->bounds());
  expect_same_bricks(*field->bricks(), *other->bricks());
  return true;
}

/// The same under every policy.
int compare_policies(const std::filesystem::path& path, const std::string& grid) {
  int densities = 0;
  for (const LevelSetPolicy level_set : {LevelSetPolicy::refuse, LevelSetPolicy::to_fog}) {
    for (const BadValuePolicy bad : {BadValuePolicy::refuse, BadValuePolicy::to_zero})
      densities += expect_same_density(path, {grid, level_set, bad}) ? 1 : 0;
  }
  return densities;
}

class DensityVoxelsTest : public testing::Test {
 protected:
  TempFolder folder;
  std::filesystem::path path = folder / "a.vdb";

  int compare(const openvdb::GridCPtrVec& grids, const std::string& grid = "") {
    write_with_openvdb(path, grids);
    return compare_policies(path, grid);
  }
};

template <class Grid = openvdb::FloatGrid>
typename Grid::Ptr small_tree(unsigned seed, typename Grid::ValueType background = {}) {
  return random_tree<Grid>(seed, background, 2);
}

TEST_F(DensityVoxelsTest, random_trees_of_every_type_under_every_policy) {
  EXPECT_EQ(compare({small_tree(1)}), 2);
  EXPECT_EQ(compare({small_tree<openvdb::DoubleGrid>(2)}), 2);
  EXPECT_EQ(compare({small_tree<openvdb::Int32Grid>(3)}), 2);
  EXPECT_EQ(compare({small_tree<openvdb::Int64Grid>(4)}), 2);
  EXPECT_EQ(compare({small_tree<openvdb::BoolGrid>(5)}), 4);
}

TEST_F(DensityVoxelsTest, level_sets_become_the_same_fog) {
  for (const float background : {0.5f, 10000.0f}) {
    auto grid = small_tree(6, background);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.7));
    EXPECT_EQ(compare({grid}), 2);
    auto outside = make_grid("density", openvdb::GRID_LEVEL_SET);
    outside->tree().setValueOn(Coord(1), background);
    EXPECT_EQ(compare({outside}), 0);
  }
}

TEST_F(DensityVoxelsTest, the_same_is_refused) {
  EXPECT_EQ(compare({make_grid()}), 0);              // empty
  EXPECT_EQ(compare({small_tree(7, 0.5f)}), 0);      // a background
  EXPECT_EQ(compare({small_tree(8)}, "densty"), 0);  // no such name
  auto vectors = make_grid<openvdb::Vec3SGrid>();
  vectors->tree().setValueOn(Coord(0), openvdb::Vec3s(1.0f));
  EXPECT_EQ(compare({vectors}), 0);
  auto frustum = make_grid();
  frustum->tree().setValueOn(Coord(0), 1.0f);
  frustum->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd({0, 0, 0}, {10, 10, 10}), 0.5, 10.0, 1.0));
  EXPECT_EQ(compare({frustum}), 0);
  auto inside_out = make_grid("density", openvdb::GRID_LEVEL_SET);
  inside_out->tree().root().setBackground(-1.0f, false);
  inside_out->tree().setValueOn(Coord(0), std::numeric_limits<float>::infinity());
  EXPECT_EQ(compare({inside_out}), 0);
  inside_out->tree().setValueOn(Coord(0), 1.0f);
  EXPECT_EQ(compare({inside_out}), 0);
}

TEST_F(DensityVoxelsTest, the_same_is_chosen_and_said) {
  const auto named = [](const std::string& name) {
    auto grid = make_grid(name);
    grid->tree().setValueOn(Coord(1), 1.0f);
    return grid;
  };
  auto unclassed = named("smoke");
  unclassed->clearGridClass();
  EXPECT_EQ(compare({named("heat"), unclassed}), 4);
  EXPECT_EQ(compare({named("heat"), unclassed}, "density"), 4);
  EXPECT_EQ(compare({named("a"), named("b")}), 0);
  EXPECT_EQ(compare({named("a"), named("a")}, "a[1]"), 4);
}

TEST_F(DensityVoxelsTest, every_grid_of_every_real_file) {
  PILEUS_REAL_FILE(data, "vdb");
  int densities = 0;
  for (const auto& file : std::filesystem::directory_iterator(data)) {
    if (file.path().extension() != ".vdb") continue;
    densities += compare_policies(file.path(), "");
    for (const VdbGridEntry& grid : read_vdb_directory(file.path()).grids) {
      SCOPED_TRACE(file.path().filename().string() + ": " + describe(grid));
      densities +=
          expect_same_density(file.path(), {grid.name, LevelSetPolicy::to_fog, BadValuePolicy::to_zero});
    }
  }
  EXPECT_GE(densities, 20);
}

}  // namespace
}  // namespace pileus
