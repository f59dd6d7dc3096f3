#include "vdb_io/openvdb/nvdb_grids.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "tests/fixtures/temp_folder.h"
#include "tests/vdb_io/vdb_test_files.h"
#include "vdb_io/nvdb/nvdb_layout.h"
#include "vdb_io/openvdb/vdb_reader.h"
#include "vdb_io/vdb_directory.h"

namespace pileus {
namespace {

using openvdb::Coord;

/// Leaves, tiles of every level, active and not, far out and below zero, around values that are hard to keep.
template <class Grid, class MakeValue>
typename Grid::Ptr rich_grid(const MakeValue& value) {
  initialize_openvdb();
  auto grid = Grid::create(value(0));
  std::mt19937 random(5);
  std::uniform_int_distribution<int> place(-300, 300);
  for (int i = 1; i < 400; ++i) {
    const Coord p(place(random), place(random), place(random));
    if (i % 7 == 0) {
      grid->tree().setValueOff(p, value(i));
    } else {
      grid->tree().setValueOn(p, value(i));
    }
  }
  grid->tree().addTile(1, Coord(800, 0, 0), value(3), true);
  grid->tree().addTile(1, Coord(808, 0, 0), value(4), false);
  grid->tree().addTile(2, Coord(-2048, 128, 0), value(5), true);
  grid->tree().addTile(3, Coord(-8192, -4096, 4096), value(6), true);
  grid->tree().addTile(3, Coord(8192, -4096, 4096), value(7), false);
  grid->tree().setValueOff(Coord(100000, -100000, 5), value(8));  // a branch without an active voxel
  grid->setName("grid");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  matrix.postRotate(openvdb::math::X_AXIS, 0.3);
  matrix.postScale(openvdb::Vec3d(0.1, 0.2, 0.7));
  matrix.setTranslation(openvdb::Vec3d(3, -1, 1.0 / 3));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  return grid;
}

/// Topology, states, backgrounds and every value, bit for bit, inactive ones included.
template <class Grid>
void expect_same(const Grid& a, const Grid& b) {
  ASSERT_TRUE(a.tree().hasSameTopology(b.tree()));
  const auto same = [](const auto& x, const auto& y) { return std::memcmp(&x, &y, sizeof x) == 0; };
  EXPECT_TRUE(same(a.background(), b.background()));
  auto at_a = a.cbeginValueAll();
  auto at_b = b.cbeginValueAll();
  size_t count = 0;
  for (; at_a && at_b; ++at_a, ++at_b, ++count) {
    ASSERT_TRUE(same(*at_a, *at_b)) << at_a.getCoord();
    ASSERT_EQ(at_a.isValueOn(), at_b.isValueOn());
    ASSERT_EQ(at_a.getCoord(), at_b.getCoord());
  }
  EXPECT_GT(count, 100000u);
  EXPECT_FALSE(at_a);
  EXPECT_FALSE(at_b);
}

class Nvdb : public testing::Test {
 protected:
  TempFolder folder;
  std::filesystem::path path = folder / "a.nvdb";

  openvdb::GridBase::Ptr round_trip(const openvdb::GridBase& grid, NvdbCodec codec = NvdbCodec::none) {
    std::vector<NvdbBuffer> buffers;
    buffers.push_back(nvdb_from_grid(path, grid));
    write_nvdb(path, buffers, codec);
    const NvdbDirectory directory = read_nvdb_directory(path);
    EXPECT_EQ(directory.grids.size(), 1u);
    const NvdbGridEntry& entry = directory.grids.front();
    EXPECT_EQ(entry.active_voxels, grid.activeVoxelCount());
    return grid_from_nvdb(path, entry, read_nvdb_buffer(path, entry));
  }

  template <class Grid, class MakeValue>
  void expect_nothing_lost(const MakeValue& value) {
    const auto grid = rich_grid<Grid>(value);
    const auto back = openvdb::gridPtrCast<Grid>(round_trip(*grid));
    ASSERT_TRUE(back);
    expect_same(*grid, *back);
    EXPECT_EQ(back->getName(), "grid");
    EXPECT_EQ(back->getGridClass(), openvdb::GRID_FOG_VOLUME);
    const openvdb::Mat4R matrix = grid->transform().baseMap()->getAffineMap()->getMat4();
    EXPECT_EQ(back->transform().baseMap()->getAffineMap()->getMat4(), matrix);
  }
};

TEST_F(Nvdb, loses_nothing_of_any_type) {
  const float odd[] = {0.0f,
                       -0.0f,
                       std::numeric_limits<float>::denorm_min(),
                       std::nanf("7"),
                       std::numeric_limits<float>::infinity(),
                       1.0f / 3};
  expect_nothing_lost<openvdb::FloatGrid>([&](int i) { return i < 6 ? odd[i] : float(i) / 7; });
  expect_nothing_lost<openvdb::DoubleGrid>([](int i) { return i / 7.0; });
  expect_nothing_lost<openvdb::Int32Grid>([](int i) { return i * 5381 - 70000; });
  expect_nothing_lost<openvdb::BoolGrid>([](int i) { return i % 2 == 1; });
  expect_nothing_lost<openvdb::Vec3SGrid>(
      [](int i) { return openvdb::Vec3s(float(i), -1.0f / float(i + 1), 2); });
}

TEST_F(Nvdb, packs_and_unpacks) {
  const auto grid = rich_grid<openvdb::FloatGrid>([](int i) { return float(i); });
  for (const NvdbCodec codec : {NvdbCodec::zip, NvdbCodec::blosc}) {
    const auto back = openvdb::gridPtrCast<openvdb::FloatGrid>(round_trip(*grid, codec));
    expect_same(*grid, *back);
    EXPECT_LT(std::filesystem::file_size(path), read_nvdb_directory(path).grids.front().memory_bytes / 10);
  }
}

TEST_F(Nvdb, keeps_common_transforms_as_they_are) {
  for (const double voxel : {0.1, 1.0, 1.0 / 3}) {
    const auto grid = make_grid();
    grid->tree().setValueOn(Coord(1, 2, 3), 1.0f);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    EXPECT_EQ(round_trip(*grid)->transform(), grid->transform());
    grid->transform().postTranslate(openvdb::Vec3d(0.5, -3, 8));
    EXPECT_EQ(round_trip(*grid)->transform(), grid->transform());
  }
}

TEST_F(Nvdb, keeps_classes_empty_grids_and_long_names) {
  for (const auto grid_class : {openvdb::GRID_LEVEL_SET, openvdb::GRID_STAGGERED, openvdb::GRID_UNKNOWN}) {
    const auto grid = make_grid("x", grid_class);
    EXPECT_EQ(round_trip(*grid)->getGridClass(), grid_class);
    EXPECT_TRUE(round_trip(*grid)->empty());
  }
  const std::string name(1000, 'n');
  const auto grid = make_grid(name);
  grid->tree().setValueOn(Coord(0), 1.0f);
  EXPECT_EQ(round_trip(*grid)->getName(), name);
}

TEST_F(Nvdb, holds_several_grids_and_writes_the_same_bytes_again) {
  std::vector<NvdbBuffer> buffers;
  buffers.push_back(nvdb_from_grid(path, *rich_grid<openvdb::FloatGrid>([](int i) { return float(i); })));
  buffers.push_back(
      nvdb_from_grid(path, *rich_grid<openvdb::Vec3SGrid>([](int i) { return openvdb::Vec3s(float(i)); })));
  write_nvdb(path, buffers, NvdbCodec::zip);
  const std::string first = read_bytes(path);
  write_nvdb(path, buffers, NvdbCodec::zip);
  EXPECT_EQ(read_bytes(path), first);
  const NvdbDirectory directory = read_nvdb_directory(path);
  ASSERT_EQ(directory.grids.size(), 2u);
  EXPECT_EQ(nvdb_value_type(directory.grids[1].type), "vec3s");
  EXPECT_TRUE(grid_from_nvdb(path, directory.grids[1], read_nvdb_buffer(path, directory.grids[1]))
                  ->isType<openvdb::Vec3SGrid>());
}

TEST_F(Nvdb, reads_what_nanovdbs_own_tools_wrote) {
  PILEUS_REAL_FILE(nano, "nvdb/dragon.nvdb");
  PILEUS_REAL_FILE(open, "vdb/dragon.vdb");
  const NvdbDirectory directory = read_nvdb_directory(nano);
  ASSERT_EQ(directory.grids.size(), 1u);
  const auto back = openvdb::gridPtrCast<openvdb::FloatGrid>(
      grid_from_nvdb(nano, directory.grids[0], read_nvdb_buffer(nano, directory.grids[0])));
  const auto original = read_density_grid(open).grid;
  ASSERT_TRUE(back);
  ASSERT_TRUE(back->tree().hasSameTopology(original->tree()));
  for (auto value = original->cbeginValueOn(); value; ++value) {
    ASSERT_EQ(back->tree().getValue(value.getCoord()), *value);
  }
  // Written again, only the head may differ: statistics of nodes and checksums are NanoVDB's own.
  const NvdbBuffer theirs = read_nvdb_buffer(nano, directory.grids[0]);
  const NvdbBuffer ours = nvdb_from_grid(path, *back);
  ASSERT_EQ(ours.size(), theirs.size());
  EXPECT_EQ(std::memcmp(ours.data() + 16, theirs.data() + 16, 24), 0);
}

TEST_F(Nvdb, unpacks_fp8_within_half_a_step_of_each_leaf) {
  PILEUS_REAL_FILE(nano, "nvdb/sphere_levelset_fp8.nvdb");
  PILEUS_REAL_FILE(open, "vdb/sphere_levelset.vdb");
  const NvdbDirectory directory = read_nvdb_directory(nano);
  const auto back = openvdb::gridPtrCast<openvdb::FloatGrid>(
      grid_from_nvdb(nano, directory.grids[0], read_nvdb_buffer(nano, directory.grids[0])));
  ASSERT_TRUE(back);
  const VdbDirectory original_directory = read_vdb_directory(open);
  const auto original = read_scalar_grid(open, original_directory, original_directory.grids.front());
  ASSERT_TRUE(back->tree().hasSameTopology(original->tree()));
  const double half_step = 0.5 * 0.3 / 255;  // values span at most -0.15 to 0.15
  for (auto value = original->cbeginValueOn(); value; ++value) {
    ASSERT_NEAR(back->tree().getValue(value.getCoord()), *value, 1.01 * half_step);
  }
}

// --- hostile images ---

/// What reading a changed image complains about; "" where it is accepted.
std::string refusal(const std::filesystem::path& path, const NvdbGridEntry& entry, const NvdbBuffer& buffer) {
  return error_of([&] { grid_from_nvdb(path, entry, buffer); });
}

class HostileNvdb : public Nvdb {
 protected:
  NvdbBuffer image = nvdb_from_grid(path, *rich_grid<openvdb::FloatGrid>([](int i) { return float(i); }));
  NvdbGridEntry entry;

  HostileNvdb() {
    entry.name = "grid";
    entry.type = 1;
    entry.memory_bytes = image.size();
  }

  template <class T>
  void set(uint64_t offset, T value) {
    std::memcpy(image.data() + offset, &value, sizeof value);
  }
  /// Without a checksum, only the structure stands between the image and its reader.
  void drop_checksum() { set<uint64_t>(8, ~uint64_t(0)); }
};

TEST_F(HostileNvdb, a_changed_byte_breaks_the_checksum) {
  EXPECT_EQ(refusal(path, entry, image), "");
  std::mt19937_64 random(3);
  // Any byte of the first two nodes' values or of the head beyond the version.
  for (int n = 0; n < 200; ++n) {
    const uint64_t place = 40 + random() % 100000;
    const std::byte old = image.data()[place];
    image.data()[place] = old ^ std::byte{0x10};
    EXPECT_NE(refusal(path, entry, image), "") << "byte " << place;
    image.data()[place] = old;
  }
}

TEST_F(HostileNvdb, every_link_is_checked) {
  drop_checksum();
  EXPECT_EQ(refusal(path, entry, image), "");
  constexpr uint64_t kTree = 672, kRoot = 736;
  const struct {
    uint64_t offset;
    int64_t value;
    const char* complaint;
  } cases[] = {{kTree + 24, int64_t(1) << 40, "the root of"},
               {kTree + 24, -1024, "the root lies outside"},
               {kTree + 24, 72, "the root is not aligned"},
               {kRoot + 64 + 8, int64_t(1) << 62, "an internal node"},
               {kRoot + 64 + 8, std::numeric_limits<int64_t>::min(), "an upper node lies outside"},
               {kRoot + 64 + 8, 33, "an internal node is not aligned"},
               {32, 100, "it claims 100 bytes"},
               {0, 0, "it does not start as a grid"}};
  for (const auto& one : cases) {
    int64_t old = 0;
    std::memcpy(&old, image.data() + one.offset, sizeof old);
    set(one.offset, one.value);
    expect_mentions(refusal(path, entry, image), one.complaint);
    set(one.offset, old);
  }
  const float nan = std::nanf("");
  set<double>(296 + 88, nan);  // the map's matrix in double
  expect_mentions(refusal(path, entry, image), "its transform cannot be inverted");
}

TEST_F(HostileNvdb, a_child_met_twice_is_refused) {
  drop_checksum();
  // All root tiles that are nodes lead to the first one.
  const auto& root = *reinterpret_cast<const nanovdb::NanoRoot<float>::DataType*>(image.data() + 736);
  int64_t first = 0;
  int changed = 0;
  for (uint32_t i = 0; i < root.mTableSize; ++i) {
    const uint64_t child = 736 + sizeof root + i * 32 + 8;
    int64_t step = 0;
    std::memcpy(&step, image.data() + child, sizeof step);
    if (step == 0) continue;
    if (first == 0) first = step;
    if (step != first) ++changed;
    set(child, first);
  }
  ASSERT_GT(changed, 0);
  EXPECT_NE(refusal(path, entry, image), "");
}

TEST_F(HostileNvdb, random_damage_never_escapes) {
  drop_checksum();
  std::mt19937_64 random(17);
  int refused = 0;
  for (int n = 0; n < 120; ++n) {
    const uint64_t place = n % 2 == 0 ? random() % 2000 : random() % (image.size() - 8);
    std::byte old[8];
    std::memcpy(old, image.data() + place, 8);
    set(place, random());
    refused += refusal(path, entry, image).empty() ? 0 : 1;
    std::memcpy(image.data() + place, old, 8);
  }
  EXPECT_GT(refused, 5) << "most damage hits values, which may be anything";
}

TEST_F(HostileNvdb, files_cut_short_or_with_wild_sizes_are_refused) {
  std::vector<NvdbBuffer> buffers;
  buffers.push_back(nvdb_from_grid(path, *make_grid()));
  write_nvdb(path, buffers, NvdbCodec::zip);
  const std::string whole = read_bytes(path);
  const auto read_all = [&] {
    for (const NvdbGridEntry& one : read_nvdb_directory(path).grids) {
      grid_from_nvdb(path, one, read_nvdb_buffer(path, one));
    }
  };
  EXPECT_EQ(error_of(read_all), "");
  for (size_t length = 0; length < whole.size(); ++length) {
    write_bytes(path, whole.substr(0, length));
    EXPECT_NE(error_of(read_all), "") << length;
  }
  for (size_t place = 0; place < whole.size(); ++place) {
    for (const char value : {'\0', '\x7f', '\xff'}) {
      std::string bytes = whole;
      bytes[place] = value;
      write_bytes(path, bytes);
      error_of(read_all);  // an Error or none, no crash
    }
  }
  write_bytes(path, "version https://git-lfs.github.com/spec/v1\n");
  expect_mentions(error_of(read_all), "does not start as a NanoVDB file does");
}

}  // namespace
}  // namespace pileus
