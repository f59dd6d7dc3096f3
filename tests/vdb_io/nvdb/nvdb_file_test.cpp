#include "vdb_io/nvdb/nvdb_file.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "tests/fixtures/temp_folder.h"
#include "vdb_io/nvdb/nvdb_checksum.h"
#include "vdb_io/nvdb/nvdb_layout.h"

namespace pileus {
namespace {

std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

void expect_mentions(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "in: " << text << "\nexpected: " << part;
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The image of a grid without nodes: head, tree and a root, with bytes behind them that the codecs have to
/// carry.
NvdbBuffer image(const std::string& name, nanovdb::GridType type = nanovdb::GridType::Float) {
  NvdbBuffer buffer(4096);
  auto& grid = *reinterpret_cast<nanovdb::GridData*>(buffer.data());
  auto& tree = *reinterpret_cast<nanovdb::TreeData<3>*>(buffer.data() + sizeof grid);
  grid.mMagic = kNvdbMagic;
  grid.mVersion = nanovdb::Version();
  grid.mGridSize = buffer.size();
  grid.mGridType = type;
  grid.mGridClass = nanovdb::GridClass::FogVolume;
  std::memcpy(grid.mGridName, name.data(), name.size());
  tree.mNodeOffset[3] = sizeof tree;
  tree.mVoxelCount = 42;
  std::mt19937 random(5);
  for (size_t i = 2048; i < 4096; ++i) buffer.data()[i] = std::byte(random() % 16);
  return buffer;
}

class NvdbFile : public testing::Test {
 protected:
  TempFolder folder;
  std::filesystem::path path = folder / "a.nvdb";

  void write(const std::string& bytes) const { std::ofstream(path, std::ios::binary) << bytes; }
  void read_all() const {
    for (const NvdbGridEntry& entry : read_nvdb_directory(path).grids) read_nvdb_buffer(path, entry);
  }
  void write_two(NvdbCodec codec) const {
    std::vector<NvdbBuffer> buffers;
    buffers.push_back(image("density"));
    buffers.push_back(image("vel", nanovdb::GridType::Vec3f));
    write_nvdb(path, buffers, codec);
  }
};

TEST_F(NvdbFile, brings_every_byte_back_through_every_codec) {
  for (const NvdbCodec codec : {NvdbCodec::none, NvdbCodec::zip, NvdbCodec::blosc}) {
    write_two(codec);
    const NvdbDirectory directory = read_nvdb_directory(path);
    EXPECT_EQ(directory.version_major, 32u);
    ASSERT_EQ(directory.grids.size(), 2u);
    EXPECT_EQ(directory.grids[0].name, "density");
    EXPECT_EQ(nvdb_value_type(directory.grids[0].type), "float");
    EXPECT_EQ(nvdb_class_name(directory.grids[0].grid_class), "fog volume");
    EXPECT_EQ(directory.grids[0].active_voxels, 42u);
    EXPECT_EQ(directory.grids[1].name, "vel");
    EXPECT_EQ(nvdb_value_type(directory.grids[1].type), "vec3s");
    const NvdbBuffer back = read_nvdb_buffer(path, directory.grids[1]),
                     sent = image("vel", nanovdb::GridType::Vec3f);
    ASSERT_EQ(back.size(), sent.size());
    EXPECT_EQ(std::memcmp(back.data(), sent.data(), sent.size()), 0);
    EXPECT_EQ(std::filesystem::file_size(path) < 6000, codec != NvdbCodec::none);
  }
}

TEST_F(NvdbFile, of_the_same_grids_has_the_same_bytes) {
  write_two(NvdbCodec::blosc);
  const std::string first = bytes_of(path);
  write_two(NvdbCodec::blosc);
  EXPECT_EQ(bytes_of(path), first);
}

TEST_F(NvdbFile, cut_short_anywhere_is_refused) {
  for (const NvdbCodec codec : {NvdbCodec::none, NvdbCodec::zip, NvdbCodec::blosc}) {
    write_two(codec);
    const std::string whole = bytes_of(path);
    for (size_t length = 0; length < whole.size(); length += length < 400 ? 5 : 211) {
      write(whole.substr(0, length));
      EXPECT_NE(error_of([&] { read_all(); }), "") << length;
    }
    write(whole + "x");
    EXPECT_NE(error_of([&] { read_all(); }), "");
  }
}

TEST_F(NvdbFile, with_any_byte_changed_never_escapes) {
  for (const NvdbCodec codec : {NvdbCodec::zip, NvdbCodec::blosc}) {
    write_two(codec);
    const std::string whole = bytes_of(path);
    for (size_t place = 0; place < whole.size(); place += place < 400 ? 3 : 97) {
      for (const char value : {'\0', '\x7f', '\xff'}) {
        std::string bytes = whole;
        bytes[place] = value;
        write(bytes);
        error_of([&] { read_all(); });  // an Error or none: no crash, no endless allocation
      }
    }
  }
}

TEST_F(NvdbFile, says_what_is_wrong) {
  const auto refusal = [&](const std::string& bytes) {
    write(bytes);
    return error_of([&] { read_all(); });
  };
  expect_mentions(refusal(""), "is empty (0 bytes)");
  expect_mentions(refusal("NanoVDB0"), "too short");
  expect_mentions(refusal("version https://git-lfs.github.com/spec/v1"),
                  "does not start as a NanoVDB file does");
  write_two(NvdbCodec::zip);
  const std::string whole = bytes_of(path);
  std::string other = whole;
  other[11] = '\x06';  // version 48
  expect_mentions(refusal(other), "has NanoVDB layout 48");
  other = whole;
  other[16 + 7] = '\1';  // 2^56 bytes unpacked
  expect_mentions(refusal(other), "claims 72057594037932032 bytes unpacked from");
  other = whole;
  other[12] = other[13] = '\xff';
  expect_mentions(refusal(other), "65535 grids at byte 0");
}

TEST_F(NvdbFile, checksum_of_the_head_is_nanovdbs_own) {
  const std::filesystem::path real = std::filesystem::path(PILEUS_DATA_DIR) / "nvdb/dragon.nvdb";
  if (!std::filesystem::exists(real)) GTEST_SKIP() << "no nvdb/dragon.nvdb in PILEUS_DATA_DIR";
  const NvdbDirectory directory = read_nvdb_directory(real);
  ASSERT_EQ(directory.grids.size(), 1u);
  EXPECT_EQ(directory.grids[0].name, "density");
  EXPECT_EQ(directory.grids[0].active_voxels, 19660u);
  NvdbBuffer buffer = read_nvdb_buffer(real, directory.grids[0]);
  uint64_t stored = 0;
  std::memcpy(&stored, buffer.data() + 8, sizeof stored);
  using Root = nanovdb::NanoRoot<float>::DataType;
  NvdbNodes nodes;
  nodes.head_bytes = 672 + 64 + sizeof(Root) + sizeof(Root::Tile);  // one upper node
  EXPECT_TRUE(nvdb_checksum_agrees(stored, buffer, nodes));
  buffer.data()[100] ^= std::byte{1};
  EXPECT_FALSE(nvdb_checksum_agrees(stored, buffer, nodes));
}

}  // namespace
}  // namespace pileus
