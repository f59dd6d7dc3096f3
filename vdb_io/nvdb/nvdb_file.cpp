#include "vdb_io/nvdb/nvdb_file.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <map>

#include <blosc.h>
#include <zlib.h>

#include "lib/core/atomic_file.h"
#include "lib/core/error.h"
#include "vdb_io/file_cursor.h"
#include "vdb_io/nvdb/nvdb_layout.h"

namespace pileus {
namespace {

constexpr uint64_t kBloscChunk = uint64_t(1) << 30;

/// What a packed grid may unpack to. Both codecs reach some 1000 : 1 on zeros; no volume comes near this.
uint64_t most_unpacked(uint64_t packed) {
  return (uint64_t(64) << 20) + 256 * packed;
}

const char* codec_name(uint16_t codec) {
  return codec == 0 ? "none" : codec == 1 ? "zip" : "blosc";
}

void check_segment(const FileCursor& file, uint64_t begin, const NvdbSegmentHead& head) {
  if (head.magic != kNvdbMagic && head.magic != kNvdbMagicFile) {
    file.fail(begin == 0
                  ? "does not start as a NanoVDB file does (\"NanoVDB0\" or \"NanoVDB2\"); expected an "
                    ".nvdb file"
                  : fmt::format("is damaged: no segment starts at byte {}", begin));
  }
  if (nvdb_major(head.version) != kNvdbLayout) {
    file.fail(fmt::format("has NanoVDB layout {}.{}; expected {}; write it again with NanoVDB 10 to 12",
                          nvdb_major(head.version), nvdb_minor(head.version), kNvdbLayout));
  }
  if (head.codec > 2) file.fail(fmt::format("is damaged: codec {} at byte {}", head.codec, begin + 14));
  if (head.grid_count > file.remaining() / sizeof(NvdbGridHead)) {
    file.fail(fmt::format("is damaged or cut short: {} grids at byte {}, {} bytes are left", head.grid_count,
                          begin, file.remaining()));
  }
}

NvdbGridEntry read_entry(FileCursor& file, uint16_t codec) {
  constexpr uint32_t kLongestName = 1 << 16;
  const uint64_t begin = file.position();
  const auto head = file.get<NvdbGridHead>("a grid's description");
  if (head.name_bytes < 1 || head.name_bytes > kLongestName) {
    file.fail(fmt::format("is damaged: a name of {} bytes at byte {}", head.name_bytes, begin + 136));
  }
  NvdbGridEntry entry;
  entry.name.resize(head.name_bytes);
  file.read(entry.name.data(), head.name_bytes, "a grid's name");
  entry.name.resize(std::min(entry.name.find('\0'), entry.name.size()));
  std::replace_if(
      entry.name.begin(), entry.name.end(), [](unsigned char c) { return c < 32 || c == 127; }, ' ');
  entry.type = head.type;
  entry.grid_class = head.grid_class;
  entry.active_voxels = head.active_voxels;
  entry.codec = NvdbCodec(codec);
  entry.memory_bytes = head.memory_bytes;
  entry.file_bytes = head.file_bytes;
  const bool is_packed = entry.codec != NvdbCodec::none;
  const bool fits = is_packed ? entry.memory_bytes <= most_unpacked(entry.file_bytes)
                              : entry.memory_bytes == entry.file_bytes;
  if (entry.memory_bytes == 0 || !fits) {
    file.fail(fmt::format("is damaged: grid \"{}\" claims {} bytes unpacked from {} (codec {}), at byte {}",
                          entry.name, entry.memory_bytes, entry.file_bytes, codec_name(codec), begin));
  }
  return entry;
}

[[noreturn]] void fail_unpacking(const FileCursor& file, const NvdbGridEntry& entry) {
  file.fail(fmt::format(
      "is damaged: grid \"{}\" cannot be unpacked ({}, bytes {} to {}); fetch the file again", entry.name,
      codec_name(uint16_t(entry.codec)), entry.begin, entry.begin + entry.file_bytes));
}

std::vector<char> read_packed(FileCursor& file, const NvdbGridEntry& entry) {
  const auto bytes = file.get<uint64_t>("the size of packed voxels");
  if (bytes > file.remaining()) fail_unpacking(file, entry);
  std::vector<char> packed(bytes);
  file.read(packed.data(), bytes, "packed voxels");
  return packed;
}

void unzip(FileCursor& file, const NvdbGridEntry& entry, NvdbBuffer& buffer) {
  const std::vector<char> packed = read_packed(file, entry);
  uLongf bytes = buffer.size();
  const int status = ::uncompress(reinterpret_cast<Bytef*>(buffer.data()), &bytes,
                                  reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (status != Z_OK || bytes != buffer.size()) fail_unpacking(file, entry);
}

/// Blosc is handed no length of its input: its header is held against what is there.
void unblosc(FileCursor& file, const NvdbGridEntry& entry, NvdbBuffer& buffer) {
  for (uint64_t at = 0; at < buffer.size(); at += kBloscChunk) {
    const uint64_t chunk = std::min(kBloscChunk, buffer.size() - at);
    const std::vector<char> packed = read_packed(file, entry);
    size_t unpacked_bytes = 0;
    if (packed.size() < BLOSC_MIN_HEADER_LENGTH ||
        ::blosc_cbuffer_validate(packed.data(), packed.size(), &unpacked_bytes) != 0 ||
        unpacked_bytes != chunk) {
      fail_unpacking(file, entry);
    }
    if (::blosc_decompress_ctx(packed.data(), buffer.data() + at, chunk, 1) != int(chunk)) {
      fail_unpacking(file, entry);
    }
  }
}

void append(std::string& bytes, const void* data, size_t count) {
  bytes.append(static_cast<const char*>(data), count);
}

void append_sized(std::string& bytes, const std::string& packed) {
  const uint64_t size = packed.size();
  append(bytes, &size, sizeof size);
  bytes += packed;
}

std::string zipped(const NvdbBuffer& buffer) {
  uLongf bytes = ::compressBound(buffer.size());
  std::string packed(bytes, '\0');
  const int status = ::compress(reinterpret_cast<Bytef*>(packed.data()), &bytes,
                                reinterpret_cast<const Bytef*>(buffer.data()), buffer.size());
  PILEUS_CHECK(status == Z_OK);
  packed.resize(bytes);
  return packed;
}

std::string blosc_packed(const std::byte* data, uint64_t bytes) {
  std::string packed(bytes + BLOSC_MAX_OVERHEAD, '\0');
  const int count = ::blosc_compress_ctx(9, 1, sizeof(float), bytes, data, packed.data(), packed.size(),
                                         BLOSC_LZ4_COMPNAME, 1 << 18, 1);
  PILEUS_CHECK(count > 0);
  packed.resize(size_t(count));
  return packed;
}

std::string file_bytes_of(const NvdbBuffer& buffer, NvdbCodec codec) {
  std::string bytes;
  if (codec == NvdbCodec::none) {
    append(bytes, buffer.data(), buffer.size());
  } else if (codec == NvdbCodec::zip) {
    append_sized(bytes, zipped(buffer));
  } else {
    for (uint64_t at = 0; at < buffer.size(); at += kBloscChunk) {
      append_sized(bytes, blosc_packed(buffer.data() + at, std::min(kBloscChunk, buffer.size() - at)));
    }
  }
  return bytes;
}

/// NanoVDB's hash of a name: readers look grids up by it.
uint64_t name_hash(const std::string& name) {
  uint64_t hash = 0;
  for (const char c : name) {
    const uint64_t overflow = hash >> 56;
    hash = hash * 67 + static_cast<unsigned char>(c) + overflow;
  }
  return hash;
}

std::string long_name(const NvdbBuffer& buffer, const nanovdb::GridData& grid) {
  if (grid.mBlindMetadataCount == 0) return grid.mGridName;
  const std::byte* blind = buffer.data() + grid.mBlindMetadataOffset;
  return reinterpret_cast<const char*>(blind + sizeof(nanovdb::GridBlindMetaData));
}

NvdbGridHead head_of(const nanovdb::GridData& grid, const nanovdb::TreeData<3>& tree, NvdbCodec codec) {
  NvdbGridHead head{};
  head.memory_bytes = grid.mGridSize;
  head.active_voxels = tree.mVoxelCount;
  head.type = uint32_t(grid.mGridType);
  head.grid_class = uint32_t(grid.mGridClass);
  std::memcpy(head.world_bounds, &grid.mWorldBBox, sizeof head.world_bounds);
  std::memcpy(head.voxel_size, &grid.mVoxelSize, sizeof head.voxel_size);
  // The box of active voxels heads every root, whatever its type.
  const std::byte* root = reinterpret_cast<const std::byte*>(&tree) + tree.mNodeOffset[3];
  std::memcpy(head.index_bounds, root, sizeof head.index_bounds);
  for (int level = 0; level < 3; ++level) {
    head.node_counts[level] = tree.mNodeCount[level];
    head.tile_counts[level] = tree.mTileCount[level];
  }
  head.node_counts[3] = 1;
  head.codec = uint16_t(codec);
  head.version = nanovdb::Version().id();
  return head;
}

}  // namespace

NvdbDirectory read_nvdb_directory(const std::filesystem::path& path) {
  FileCursor file(path);
  NvdbDirectory directory;
  directory.file_bytes = file.size();
  if (file.size() == 0) file.fail("is empty (0 bytes); expected a NanoVDB file; fetch it again");
  while (file.remaining() > 0) {
    const uint64_t begin = file.position();
    if (begin == 0 && file.remaining() < sizeof(NvdbSegmentHead)) file.fail("is no NanoVDB file: too short");
    const auto head = file.get<NvdbSegmentHead>("a segment's header");
    check_segment(file, begin, head);
    directory.version_major = nvdb_major(head.version);
    directory.version_minor = nvdb_minor(head.version);
    const size_t first = directory.grids.size();
    for (uint16_t i = 0; i < head.grid_count; ++i) directory.grids.push_back(read_entry(file, head.codec));
    for (size_t i = first; i < directory.grids.size(); ++i) {
      directory.grids[i].begin = file.position();
      file.skip(directory.grids[i].file_bytes, "a grid");
    }
  }
  return directory;
}

NvdbBuffer read_nvdb_buffer(const std::filesystem::path& path, const NvdbGridEntry& entry) {
  FileCursor file(path);
  if (entry.begin > file.size() || entry.file_bytes > file.size() - entry.begin) {
    file.fail("has become shorter while it was being read");
  }
  file.enter(entry.begin, entry.begin + entry.file_bytes);
  NvdbBuffer buffer(entry.memory_bytes);
  switch (entry.codec) {
    case NvdbCodec::zip:
      unzip(file, entry, buffer);
      break;
    case NvdbCodec::blosc:
      unblosc(file, entry, buffer);
      break;
    case NvdbCodec::none:
      file.read(buffer.data(), entry.memory_bytes, "a grid");
  }
  if (file.remaining() != 0) fail_unpacking(file, entry);
  return buffer;
}

std::string nvdb_value_type(uint32_t type) {
  static const std::map<uint32_t, std::string> kNames{
      {1, "float"},  {2, "double"}, {3, "int16"},   {4, "int32"},  {5, "int64"},  {6, "vec3s"},
      {7, "vec3d"},  {8, "mask"},   {10, "uint32"}, {11, "bool"},  {12, "rgba8"}, {13, "float"},
      {14, "float"}, {15, "float"}, {16, "float"},  {17, "vec4s"}, {18, "vec4d"}, {19, "index"}};
  const auto found = kNames.find(type);
  return found == kNames.end() ? fmt::format("type {}", type) : found->second;
}

std::string nvdb_class_name(uint32_t grid_class) {
  return grid_class == 1   ? "level set"
         : grid_class == 2 ? "fog volume"
         : grid_class == 3 ? "staggered"
                           : "unknown";
}

void write_nvdb(const std::filesystem::path& path, const std::vector<NvdbBuffer>& buffers, NvdbCodec codec) {
  NvdbSegmentHead head{kNvdbMagic, nanovdb::Version().id(), uint16_t(buffers.size()), uint16_t(codec)};
  std::string heads, bodies;
  append(heads, &head, sizeof head);
  for (const NvdbBuffer& buffer : buffers) {
    const auto& grid = *reinterpret_cast<const nanovdb::GridData*>(buffer.data());
    const auto& tree = *reinterpret_cast<const nanovdb::TreeData<3>*>(buffer.data() + sizeof grid);
    const std::string name = long_name(buffer, grid), body = file_bytes_of(buffer, codec);
    NvdbGridHead grid_head = head_of(grid, tree, codec);
    grid_head.file_bytes = body.size();
    grid_head.name_hash = name_hash(name);
    grid_head.name_bytes = uint32_t(name.size() + 1);
    append(heads, &grid_head, sizeof grid_head);
    append(heads, name.c_str(), name.size() + 1);
    bodies += body;
  }
  AtomicFile output(path);
  std::ofstream stream(output.path(), std::ios::binary);
  stream << heads << bodies;
  stream.close();
  if (!stream) throw Error(ErrorKind::file, path.string(), "cannot be written; is the disk full?");
  output.commit();
}

}  // namespace pileus
