// The direct reader of .vdb files, held against OpenVDB's: the same voxels, tiles, counts and transforms of
// random trees in every way of storing them, and of every real file.
#include "vdb_io/vdb_voxels.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <sstream>
#include <tuple>

#include "lib/core/parallel.h"
#include "tests/fixtures/temp_folder.h"
#include "tests/vdb_io/random_trees.h"
#include "tests/vdb_io/vdb_test_files.h"
#include "vdb_io/openvdb/grid_values.h"
#include "vdb_io/openvdb/vdb_reader.h"

namespace pileus {
namespace {

using openvdb::Coord;

uint32_t bits_of(float value) {
  uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

using Place = std::tuple<int, int, int>;
using TileKey = std::tuple<int, int, int, int, uint32_t>;

std::vector<TileKey> tiles_of(const openvdb::FloatTree& tree) {
  std::vector<TileKey> tiles;
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (*tile == 0.0f) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    tiles.emplace_back(box.min().x(), box.min().y(), box.min().z(), box.dim().x(), bits_of(*tile));
  }
  std::sort(tiles.begin(), tiles.end());
  return tiles;
}

std::vector<TileKey> tiles_of(const GridVoxels& voxels) {
  std::vector<TileKey> tiles;
  for (const VoxelTile& tile : voxels.tiles)
    tiles.emplace_back(tile.origin.x, tile.origin.y, tile.origin.z, tile.size, bits_of(tile.value));
  std::sort(tiles.begin(), tiles.end());
  return tiles;
}

/// Leaves hold the same bits; those that are missing are zeros.
void expect_same_leaves(const GridVoxels& voxels, const openvdb::FloatTree& tree) {
  std::map<Place, const float*> found;
  for (const GridVoxels::Leaf& leaf : voxels.leaves) {
    const bool is_new = found.emplace(Place(leaf.origin.x, leaf.origin.y, leaf.origin.z), leaf.values).second;
    EXPECT_TRUE(is_new);
  }
  size_t matched = 0;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const Coord at = leaf->origin();
    const auto here = found.find({at.x(), at.y(), at.z()});
    if (here == found.end()) {
      for (int n = 0; n < 512; ++n) ASSERT_EQ(bits_of(leaf->getValue(openvdb::Index(n))), 0u) << at;
      continue;
    }
    ++matched;
    ASSERT_EQ(std::memcmp(here->second, leaf->buffer().data(), 512 * sizeof(float)), 0) << at;
  }
  EXPECT_EQ(matched, found.size());
}

/// What was seen on the way is what a look at the leaves sees.
void expect_sound_scan(const GridVoxels& voxels) {
  if (voxels.counts.bad() > 0) return;
  std::vector<VoxelLeaf> leaves;
  for (const GridVoxels::Leaf& leaf : voxels.leaves) leaves.push_back({leaf.origin, leaf.values});
  const VoxelSource seen(leaves, voxels.tiles, nullptr, voxels.scan), looked(leaves, voxels.tiles);
  EXPECT_EQ(seen.max_value(), looked.max_value());
  for (size_t i = 0; i < leaves.size(); ++i) ASSERT_EQ(seen.reached(i), looked.reached(i));
}

void expect_same(const GridVoxels& voxels, const std::filesystem::path& path,
                 const openvdb::FloatGrid& grid) {
  EXPECT_EQ(bits_of(voxels.background), bits_of(grid.background()));
  EXPECT_EQ(voxels.active_voxels, grid.activeVoxelCount());
  EXPECT_EQ(voxels.counts, count_values(grid));
  EXPECT_EQ(voxels.world_from_index.matrix(), world_from_index(path, grid).matrix());
  EXPECT_EQ(tiles_of(voxels), tiles_of(grid.tree()));
  expect_same_leaves(voxels, grid.tree());
  expect_sound_scan(voxels);
}

/// Compares all scalar grids of a file; returns how many these are.
int compare_file(const std::filesystem::path& path) {
  const VdbDirectory directory = read_vdb_directory(path);
  int compared = 0;
  for (const VdbGridEntry& entry : directory.grids) {
    if (!entry.is_scalar()) continue;
    SCOPED_TRACE(path.filename().string() + ": " + describe(entry));
    expect_same(read_vdb_voxels(path, directory, entry), path, *read_scalar_grid(path, directory, entry));
    ++compared;
  }
  return compared;
}

class VdbVoxels : public testing::Test {
 protected:
  TempFolder folder;
  std::filesystem::path path = folder / "a.vdb";
};

constexpr uint32_t kZip = openvdb::io::COMPRESS_ZIP, kBlosc = openvdb::io::COMPRESS_BLOSC,
                   kMask = openvdb::io::COMPRESS_ACTIVE_MASK;

template <class Grid>
class VdbVoxelsOf : public VdbVoxels {};
using ScalarGrids = testing::Types<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Int32Grid,
                                   openvdb::Int64Grid, openvdb::BoolGrid>;
TYPED_TEST_SUITE(VdbVoxelsOf, ScalarGrids);

TYPED_TEST(VdbVoxelsOf, are_those_of_openvdb_however_they_are_stored) {
  using Value = typename TypeParam::ValueType;
  const std::array backgrounds{0.0, 1.0, -3.0};
  unsigned round = 0;
  for (const uint32_t compression : {0u, kMask, kZip, kZip | kMask, kBlosc, kBlosc | kMask}) {
    for (const bool half : {false, true}) {
      const double background = backgrounds[round++ % 3];
      SCOPED_TRACE(fmt::format("compression {}, half {}, background {}", compression, half, background));
      const auto grid = random_tree<TypeParam>(round, Value(background));
      grid->setSaveFloatAsHalf(half);
      write_with_openvdb(this->path, {grid}, compression);
      EXPECT_EQ(compare_file(this->path), 1);
      if (this->HasFailure()) return;
    }
  }
}

TEST_F(VdbVoxels, find_every_kind_of_inactive_values_and_all_bad_ones) {
  auto grid = random_tree<openvdb::FloatGrid>(5, 0.25f);
  const float infinity = std::numeric_limits<float>::infinity(),
              nan = std::numeric_limits<float>::quiet_NaN();
  for (const auto& [at, value] : {std::pair{Coord(1, 2, 3), nan},
                                  {Coord(-9, 2, 3), -infinity},
                                  {Coord(70, 2, 3), -1.0f},
                                  {Coord(1, 80, 3), -0.0f}}) {
    grid->tree().setValueOn(at, value);
    grid->tree().setValueOff(at + Coord(1, 0, 0), value);
  }
  write_with_openvdb(path, {grid});
  EXPECT_EQ(compare_file(path), 1);
}

TEST_F(VdbVoxels, of_no_leaves_or_tiles_only) {
  auto empty = make_grid();
  auto tiles = make_grid("tiles");
  for (int level = 1; level <= 3; ++level) {
    tiles->tree().addTile(openvdb::Index(level), Coord(8192 * level, 0, 0), 0.5f, true);
    tiles->tree().addTile(openvdb::Index(level), Coord(0, 8192 * level, 0), 0.25f, false);
  }
  write_with_openvdb(path, {empty, tiles});
  EXPECT_EQ(compare_file(path), 2);
}

TEST_F(VdbVoxels, of_leaves_of_zeros_are_left_out) {
  auto grid = make_grid();
  for (int i = 0; i < 300; ++i) grid->tree().setValueOn(Coord(8 * i, 0, 0), i % 3 == 0 ? 1.0f : 0.0f);
  write_with_openvdb(path, {grid});
  EXPECT_EQ(compare_file(path), 1);
  const VdbDirectory directory = read_vdb_directory(path);
  EXPECT_EQ(read_vdb_voxels(path, directory, directory.grids[0]).leaves.size(), 100u);
}

TEST_F(VdbVoxels, shared_by_two_grids_lie_where_each_says) {
  const auto first = random_tree<openvdb::FloatGrid>(3, 0.0f);
  first->setName("first");
  auto second = first->copy();
  second->setName("second");
  second->setTransform(openvdb::math::Transform::createLinearTransform(0.3));
  write_with_openvdb(path, {first, second});
  EXPECT_EQ(compare_file(path), 2);
}

/// The map as it is, and not the simplest one that does the same: as a file may have it.
openvdb::math::Transform::Ptr transform_of(const openvdb::math::MapBase& map) {
  std::stringstream stream;
  openvdb::io::setCurrentVersion(stream);
  openvdb::writeString(stream, map.type());
  map.write(stream);
  auto transform = std::make_shared<openvdb::math::Transform>();
  transform->read(stream);
  return transform;
}

TEST_F(VdbVoxels, have_the_transform_of_every_affine_map) {
  using namespace openvdb::math;
  openvdb::Mat4R rotated = openvdb::Mat4R::identity();
  rotated.preRotate(X_AXIS, 0.3);
  rotated.preScale(openvdb::Vec3d(0.1, 0.37, 2.5));
  rotated.setTranslation(openvdb::Vec3d(1e6 + 0.1, -3.0, 1.0 / 3.0));
  const openvdb::Vec3d scale(0.1, -0.2, 3.0), offset(-1.0 / 3.0, 1e5, 0.0);
  const std::vector<MapBase::Ptr> maps{std::make_shared<AffineMap>(rotated),
                                       std::make_shared<UnitaryMap>(Y_AXIS, 1.1),
                                       std::make_shared<ScaleMap>(scale),
                                       std::make_shared<UniformScaleMap>(0.7),
                                       std::make_shared<TranslationMap>(offset),
                                       std::make_shared<ScaleTranslateMap>(scale, offset),
                                       std::make_shared<UniformScaleTranslateMap>(0.7, offset)};
  for (const MapBase::Ptr& map : maps) {
    auto grid = make_grid();
    grid->tree().setValueOn(Coord(1, 2, 3), 1.0f);
    grid->setTransform(transform_of(*map));
    write_with_openvdb(path, {grid});
    EXPECT_EQ(read_vdb_directory(path).grids[0].map_type, map->type());
    EXPECT_EQ(compare_file(path), 1);
  }
}

TEST_F(VdbVoxels, do_not_depend_on_the_number_of_threads) {
  const auto grid = random_tree<openvdb::FloatGrid>(8, 0.0f);
  for (int i = 0; i < 2000; ++i)
    grid->tree().setValueOn(Coord(8 * (i % 50), 8 * (i / 50), 512), float(i % 7));
  write_with_openvdb(path, {grid});
  const VdbDirectory directory = read_vdb_directory(path);
  const auto read = [&](int threads) {
    GridVoxels voxels;
    with_threads(threads, [&] { voxels = read_vdb_voxels(path, directory, directory.grids[0]); });
    return voxels;
  };
  const GridVoxels one = read(1);
  for (const int threads : {2, 7}) {
    const GridVoxels many = read(threads);
    EXPECT_EQ(many.counts, one.counts);
    EXPECT_EQ(many.scan.reached, one.scan.reached);
    EXPECT_EQ(many.scan.max_value, one.scan.max_value);
    EXPECT_EQ(tiles_of(many), tiles_of(one));
    ASSERT_EQ(many.leaves.size(), one.leaves.size());
    for (size_t i = 0; i < one.leaves.size(); ++i) {
      EXPECT_EQ(many.leaves[i].origin, one.leaves[i].origin);
      ASSERT_EQ(std::memcmp(many.leaves[i].values, one.leaves[i].values, 512 * sizeof(float)), 0);
    }
  }
}

TEST_F(VdbVoxels, of_real_files_are_those_of_openvdb) {
  PILEUS_REAL_FILE(data, "vdb");
  int compared = 0;
  for (const auto& file : std::filesystem::directory_iterator(data)) {
    if (file.path().extension() == ".vdb") compared += compare_file(file.path());
  }
  EXPECT_GE(compared, 15);
}

}  // namespace
}  // namespace pileus
