#include <array>
#include <cstring>
#include <random>

#include "tests/fixtures/temp_folder.h"
#include "tests/vdb_io/vdb_test_files.h"
#include "vdb_io/density_voxels.h"
#include "vdb_io/inspect.h"
#include "vdb_io/openvdb/vdb_reader.h"
#include "vdb_io/vdb_directory.h"

namespace pileus {
namespace {

using openvdb::Coord;

constexpr size_t kVersionOffset = 8, kOffsetsFlag = 20, kFileId = 21, kGridCountOffset = 61;

class HostileFile : public testing::Test {
 protected:
  TempFolder folder;
  std::filesystem::path path = folder / "a.vdb";

  /// A small sound file: one voxel in each of two leaves, and a tile.
  std::string sound_bytes(uint32_t compression = openvdb::io::COMPRESS_ACTIVE_MASK) {
    auto grid = make_grid();
    grid->tree().addTile(2, Coord(4096, 0, 0), 0.5f, true);
    grid->tree().setValueOn(Coord(1, 2, 3), 1.0f);
    grid->tree().setValueOn(Coord(9, 2, 3), 0.25f);
    write_with_openvdb(path, {grid}, compression);
    return read_bytes(path);
  }

  template <class T>
  static std::string patched(std::string bytes, size_t offset, T value) {
    std::memcpy(bytes.data() + offset, &value, sizeof value);
    return bytes;
  }

  /// That of both readers: what the walk before them finds is the same.
  std::string error_for(const std::string& bytes) {
    write_bytes(path, bytes);
    const std::string error = error_of([&] { read_density_grid(path); });
    EXPECT_EQ(error_of([&] { read_density_voxels(path); }), error);
    return error;
  }
};

TEST_F(HostileFile, missing_file_and_folder) {
  EXPECT_EQ(error_of([&] { read_density_grid(path); }), path.string() + ": error: no such file");
  expect_mentions(error_of([&] { read_density_grid(folder.path()); }), "is not a regular file");
}

TEST_F(HostileFile, what_is_no_vdb_file_at_all) {
  expect_mentions(error_for(""), "is empty (0 bytes)");
  expect_mentions(error_for("x"), "does not start as an OpenVDB file does");
  expect_mentions(error_for("this is a text, not a volume"), "does not start as an OpenVDB file does");
  expect_mentions(error_for("version https://git-lfs.github.com/spec/v1\noid sha256:0\n"),
                  "run `git lfs pull`");
  expect_mentions(error_for("NanoVDB0 and more"), "is a NanoVDB file");
}

TEST_F(HostileFile, known_malformed_files) {
  for (const auto& [name, message] : {std::pair{"derived_empty.vdb", "is empty"},
                                      {"derived_magic_only.vdb", "cut short: the file version"},
                                      {"derived_truncated_half_smoke1.vdb", "cut short: grid \"density\""},
                                      {"real_gitlfs_pointer_bunny.vdb", "Git LFS pointer"}}) {
    PILEUS_REAL_FILE(file, std::string("malformed/") + name);
    expect_mentions(error_of([&] { read_density_grid(file); }), message);
    expect_mentions(error_of([&] { read_density_voxels(file); }), message);
    expect_mentions(error_of([&] { inspect_vdb(file); }), message);
  }
}

TEST_F(HostileFile, headers_that_lie) {
  const std::string sound = sound_bytes();
  EXPECT_EQ(error_for(sound), "");
  expect_mentions(error_for(patched(sound, kVersionOffset, uint32_t(221))), "has OpenVDB file version 221");
  expect_mentions(error_for(patched(sound, kVersionOffset, uint32_t(0xffffffff))), "expected 222 to 224");
  expect_mentions(error_for(patched(sound, kOffsetsFlag, char(0))), "is a stream without grid offsets");
  expect_mentions(error_for(patched(sound, kFileId, char('x'))), "its id is no UUID");
  expect_mentions(error_for(patched(sound, kGridCountOffset, int32_t(-1))), "claims -1 grids");
  expect_mentions(error_for(patched(sound, kGridCountOffset, int32_t(0x7fffffff))),
                  "claims 2147483647 grids");
  expect_mentions(error_for(patched(sound, kGridCountOffset - 4, uint32_t(0xffffffff))), "is damaged");
  // Voxels that begin inside the grid's transform.
  write_bytes(path, sound);
  const VdbGridEntry grid = read_vdb_directory(path).grids[0];
  const std::string offset(reinterpret_cast<const char*>(&grid.blocks_begin), sizeof grid.blocks_begin);
  expect_mentions(error_for(patched(sound, sound.find(offset), grid.topology_begin - 8)), "has no room");
  // The length of the grid's name.
  expect_mentions(error_for(patched(sound, kGridCountOffset + 4, uint32_t(0xfffffff0))),
                  "cut short: a grid's name");
}

TEST_F(HostileFile, an_unpacked_block_larger_than_its_leaf) {
  // The last block: its packed size, then 20 bytes of blosc. A negative size means unpacked; OpenVDB would
  // read a megabyte into a leaf of two kilobytes.
  const std::string sound = sound_bytes(openvdb::io::COMPRESS_ACTIVE_MASK | openvdb::io::COMPRESS_BLOSC);
  const size_t size_offset = sound.size() - 28;
  int64_t size = 0;
  std::memcpy(&size, sound.data() + size_offset, sizeof size);
  ASSERT_EQ(size, 20);
  expect_mentions(error_for(patched(sound, size_offset, int64_t(-(1 << 20))) + std::string(1 << 20, 'x')),
                  "is damaged: grid \"density\"");
  expect_mentions(error_for(patched(sound, size_offset, int64_t(1) << 62)), "is damaged");
}

TEST_F(HostileFile, packed_voxels_that_are_noise) {
  for (const uint32_t codec : {openvdb::io::COMPRESS_BLOSC, openvdb::io::COMPRESS_ZIP}) {
    auto grid = make_grid();
    grid->clearGridClass();  // fog is never zipped
    for (int i = 0; i < 512; ++i) grid->tree().setValueOn(Coord(i & 7, i >> 3 & 7, i >> 6), float(i % 5));
    write_with_openvdb(path, {grid}, codec);
    std::string bytes = read_bytes(path);
    for (size_t i = bytes.size() - 20; i < bytes.size(); ++i) bytes[i] = '\xff';
    write_bytes(path, bytes);
    expect_mentions(error_of([&] { read_density_voxels(path); }),
                    "is damaged: grid \"density\": its voxels do not unpack");
  }
}

TEST_F(HostileFile, trees_that_overlap_themselves_or_contradict_the_metadata) {
  auto grid = make_grid();
  grid->tree().addTile(3, Coord(0), 0.5f, true);
  grid->tree().addTile(3, Coord(4096, 0, 0), 0.5f, true);
  write_with_openvdb(path, {grid});
  std::string bytes = read_bytes(path);
  const int32_t second = 4096;
  const size_t at = bytes.rfind(std::string(reinterpret_cast<const char*>(&second), sizeof second));
  expect_mentions(error_for(patched(bytes, at, int32_t(0))), "a root tile lies where another one");

  grid->setSaveFloatAsHalf(true);
  write_with_openvdb(path, {grid});
  bytes = read_bytes(path);
  const std::string flag = "is_saved_as_half_float";
  const size_t value = bytes.find(flag) + flag.size() + 4 + 4 + 4;  // after the type's name and the size
  ASSERT_EQ(bytes[value], 1);
  expect_mentions(error_for(patched(bytes, value, char(0))), "disagree about half floats");
}

TEST_F(HostileFile, cut_anywhere) {
  const std::string sound = sound_bytes();
  for (size_t length = 0; length < sound.size(); length += length < 400 ? 1 : 211) {
    EXPECT_NE(error_for(sound.substr(0, length)), "") << length << " bytes";
  }
}

/// Reading either works or throws one Error, and both readers see the same; inspecting never throws more.
void read_and_inspect(const std::filesystem::path& path) {
  DensityGrid grid;
  DensityVoxels voxels;
  const bool is_read =
      error_of([&] { grid = read_density_grid(path, {.bad_values = BadValuePolicy::to_zero}); }).empty();
  const bool is_read_directly =
      error_of([&] { voxels = read_density_voxels(path, {.bad_values = BadValuePolicy::to_zero}); }).empty();
  if (is_read && is_read_directly) {
    EXPECT_EQ(voxels.voxels.counts, grid.values);
  }
  error_of([&] { inspect_vdb(path); });
}

TEST_F(HostileFile, every_header_byte_changed) {
  const std::string sound = sound_bytes();
  for (size_t offset = 0; offset < 700; ++offset) {
    const unsigned char change = std::array<unsigned char, 3>{0x01, 0x80, 0xff}[offset % 3];
    std::string bytes = sound;
    bytes[offset] = char(static_cast<unsigned char>(bytes[offset]) ^ change);
    write_bytes(path, bytes);
    read_and_inspect(path);
  }
}

TEST_F(HostileFile, bytes_of_a_real_file_changed_at_random) {
  PILEUS_REAL_FILE(dragon, "vdb/dragon.vdb");
  const std::string sound = read_bytes(dragon);
  constexpr unsigned kSeed = 1;
  std::mt19937 random(kSeed);
  for (int round = 0; round < 60; ++round) {
    std::string bytes = sound;
    const int changes = 1 << (random() % 7);
    for (int i = 0; i < changes; ++i) bytes[random() % bytes.size()] = char(random());
    write_bytes(path, bytes);
    SCOPED_TRACE(fmt::format("seed {}, round {}", kSeed, round));
    read_and_inspect(path);
  }
}

}  // namespace
}  // namespace pileus
