#include "vdb_io/openvdb/vdb_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <set>
#include <type_traits>
#include <vector>

#include <openvdb/io/File.h>

#include "lib/core/atomic_file.h"
#include "lib/core/error.h"
#include "lib/core/version.h"
#include "vdb_io/openvdb/grid_types.h"
#include "vdb_io/openvdb/grid_values.h"
#include "vdb_io/openvdb/openvdb_library.h"
#include "vdb_io/vdb_directory.h"

namespace pileus {
namespace {

constexpr double kLargestHalf = 65504.0;
constexpr std::streamoff kFileIdOffset = 21;  // magic 8, version 4, library version 8, offsets flag 1
constexpr size_t kFileIdLength = 36;

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& message) {
  throw Error(ErrorKind::file, path.string(), message);
}

void check_fog(const std::filesystem::path& path, const openvdb::FloatGrid& grid) {
  const std::string name = grid.getName();
  if (grid.background() != 0.0f) {
    fail(path,
         fmt::format("grid \"{}\" has the background {}; a fog volume needs 0", name, grid.background()));
  }
  const ValueCounts values = count_values(grid);
  if (values.nan + values.infinite > 0) {
    fail(path, fmt::format("grid \"{}\" holds {} NaN and {} infinite values; expected finite ones", name,
                           values.nan, values.infinite));
  }
}

template <class Value>
double magnitude(const Value& value) {
  if constexpr (std::is_arithmetic_v<Value>) {
    return std::abs(double(value));
  } else {
    return std::max({std::abs(double(value[0])), std::abs(double(value[1])), std::abs(double(value[2]))});
  }
}

template <class Value>
constexpr bool kIsFloating = !std::is_integral_v<Value> && !std::is_same_v<Value, openvdb::Vec3i>;

/// Half floats are for floating values: a flag on grids of whole numbers would only confuse their readers.
bool can_be_half(const openvdb::GridBase& base) {
  bool is_floating = false;
  visit_grid(base, [&](const auto& grid) {
    is_floating = kIsFloating<typename std::decay_t<decltype(grid)>::ValueType>;
  });
  return is_floating;
}

/// The largest finite number of a grid of floating values, active or not; 0 for other grids.
double largest_float(const openvdb::GridBase& base) {
  double largest = 0.0;
  visit_grid(base, [&](const auto& grid) {
    using Value = typename std::decay_t<decltype(grid)>::ValueType;
    if constexpr (kIsFloating<Value>) {
      for (auto value = grid.cbeginValueAll(); value; ++value) {
        const double size = magnitude(*value);
        if (std::isfinite(size)) largest = std::max(largest, size);
      }
    }
  });
  return largest;
}

void check_half(const std::filesystem::path& path, const openvdb::GridBase& grid) {
  const double largest = largest_float(grid);
  if (largest <= kLargestHalf) return;
  fail(path,
       fmt::format("grid \"{}\" holds {}, which half floats cannot; expected at most {}; write full floats",
                   grid.getName(), largest, kLargestHalf));
}

/// Shares the voxels of `grid`; its metadata is its own.
openvdb::GridBase::Ptr with_fog_class(const openvdb::FloatGrid& grid) {
  const auto copy = openvdb::ConstPtrCast<openvdb::GridBase>(grid.copyGrid());
  copy->setGridClass(openvdb::GRID_FOG_VOLUME);
  copy->setSaveFloatAsHalf(false);
  return copy;
}

uint32_t flags_of(VdbCodec codec) {
  switch (codec) {
    case VdbCodec::blosc:
      return openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK;
    case VdbCodec::zip:
      return openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK;
    case VdbCodec::none:
      break;
  }
  return openvdb::io::COMPRESS_ACTIVE_MASK;
}

/// A UUID (version 8: made by its maker's own rule) of two FNV-1a hashes of the bytes outside the id itself.
std::string content_id(std::istream& file) {
  std::array<uint64_t, 2> hashes{0xcbf29ce484222325u, 0x84222325cbf29ce4u};
  std::array<char, 1 << 16> buffer;
  std::streamoff position = 0;
  while (file.read(buffer.data(), buffer.size()), file.gcount() > 0) {
    for (std::streamoff i = 0; i < file.gcount(); ++i, ++position) {
      if (position >= kFileIdOffset && position < kFileIdOffset + std::streamoff(kFileIdLength)) continue;
      for (uint64_t& hash : hashes) hash = (hash ^ uint8_t(buffer[size_t(i)])) * 0x100000001b3u;
    }
  }
  return fmt::format("{:08x}-{:04x}-8{:03x}-8{:03x}-{:012x}", hashes[0] >> 32, (hashes[0] >> 16) & 0xffff,
                     hashes[0] & 0xfff, (hashes[1] >> 48) & 0xfff, hashes[1] & 0xffffffffffff);
}

void replace_file_id(const std::filesystem::path& path) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  const std::string id = content_id(file);
  PILEUS_CHECK(id.size() == kFileIdLength);
  file.clear();
  file.seekp(kFileIdOffset);
  file.write(id.data(), std::streamsize(id.size()));
  file.close();
  if (!file) fail(path, "cannot be written; is the disk full?");
}

/// OpenVDB does not notice a full disk; the finished directory shows it.
void check_written(const std::filesystem::path& target, const std::filesystem::path& written) {
  try {
    const VdbDirectory directory = read_vdb_directory(written);
    if (directory.grids.empty() || directory.grids.back().end == directory.file_bytes) return;
  } catch (const Error&) {
  }
  fail(target, "cannot be written whole; is the disk full?");
}

}  // namespace

void write_vdb(const std::filesystem::path& path, std::span<const openvdb::FloatGrid::ConstPtr> grids,
               const VdbWriteOptions& options) {
  initialize_openvdb();
  std::vector<openvdb::GridBase::ConstPtr> to_write;
  for (const auto& grid : grids) {
    check_fog(path, *grid);
    to_write.push_back(with_fog_class(*grid));
  }
  openvdb::MetaMap metadata;
  metadata.insertMeta("creator",
                      openvdb::StringMetadata(options.creator.empty() ? fmt::format("pileus {}", kVersion)
                                                                      : options.creator));
  write_vdb_grids(path, to_write, metadata, options);
}

void write_vdb_grids(const std::filesystem::path& path, std::span<const openvdb::GridBase::ConstPtr> grids,
                     const openvdb::MetaMap& metadata, const VdbWriteOptions& options) {
  initialize_openvdb();
  std::set<std::string> names;
  openvdb::GridCPtrVec to_write;
  for (const auto& grid : grids) {
    const std::string name = grid->getName();
    if (name.empty()) fail(path, "a grid to write has no name; expected one, such as \"density\"");
    if (!names.insert(name).second) {
      fail(path, fmt::format("two grids are called \"{}\"; expected different names", name));
    }
    const auto copy = openvdb::ConstPtrCast<openvdb::GridBase>(grid->copyGrid());
    if (options.half && can_be_half(*copy)) copy->setSaveFloatAsHalf(true);
    if (copy->saveFloatAsHalf()) check_half(path, *copy);
    copy->addStatsMetadata();
    to_write.push_back(copy);
  }

  AtomicFile output(path);
  try {
    openvdb::io::File file(output.path().string());
    file.setCompression(flags_of(options.codec));
    file.write(to_write, metadata);
  } catch (const std::exception& problem) {
    fail(path, fmt::format("OpenVDB cannot write it: {}", problem.what()));
  }
  check_written(path, output.path());
  replace_file_id(output.path());
  output.commit();
}

WrittenGrid written_grid(const openvdb::GridBase& grid) {
  const openvdb::GridClass grid_class = grid.getGridClass();
  WrittenGrid written;
  written.name = grid.getName();
  written.value_type = grid.valueType();
  if (grid_class != openvdb::GRID_UNKNOWN)
    written.grid_class = openvdb::GridBase::gridClassToString(grid_class);
  written.active_voxels = grid.activeVoxelCount();
  written.voxel_size = grid.voxelSize().x();
  return written;
}

}  // namespace pileus
