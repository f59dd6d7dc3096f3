#include "vdb_io/openvdb/volume_file.h"

#include <map>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "vdb_io/dense/dense_files.h"
#include "vdb_io/file_cursor.h"
#include "vdb_io/nvdb/nvdb_file.h"
#include "vdb_io/openvdb/dense_grid.h"
#include "vdb_io/openvdb/nvdb_grids.h"
#include "vdb_io/openvdb/vdb_reader.h"

namespace pileus {
namespace {

VolumeFormat known_format(const std::filesystem::path& path) {
  if (const auto format = volume_format(path)) return *format;
  FileCursor{path};  // complains of what is missing, or a folder
  throw Error(ErrorKind::usage, path.string(),
              fmt::format("extension \"{}\" is no volume's; expected {}", path.extension().string(),
                          volume_extensions()));
}

DenseVolume read_dense(const std::filesystem::path& path, VolumeFormat format, DenseRead what) {
  if (format == VolumeFormat::df3) return read_df3(path, what);
  return format == VolumeFormat::npy ? read_npy(path, what) : read_raw(path, what);
}

VdbDirectory dense_directory(const std::filesystem::path& path, VolumeFormat format) {
  const DenseVolume volume = read_dense(path, format, DenseRead::head);
  const char* kind = format == VolumeFormat::df3   ? "POV-Ray density file"
                     : format == VolumeFormat::npy ? "NumPy array"
                                                   : "raw samples";
  VdbDirectory directory;
  directory.format = fmt::format("{}, {} x {} x {} of {}", kind, volume.size.x, volume.size.y, volume.size.z,
                                 name_of(volume.stored));
  directory.file_bytes = std::filesystem::file_size(path);
  VdbGridEntry grid;
  grid.name = grid.base_name = volume.header.grid;
  const bool is_double = bytes_of(volume.stored) == 8 ||
                         (format != VolumeFormat::df3 &&
                          (volume.stored == SampleType::int32 || volume.stored == SampleType::uint32));
  grid.value_type = volume.channels == 1 ? (is_double ? "double" : "float") : (is_double ? "vec3d" : "vec3s");
  grid.grid_class = volume.header.grid_class;
  grid.map_type = "AffineMap";
  directory.grids.push_back(std::move(grid));
  return directory;
}

/// NanoVDB's codecs in the flags of OpenVDB.
uint32_t compression_flags(NvdbCodec codec) {
  return codec == NvdbCodec::zip ? 1 : codec == NvdbCodec::blosc ? 4 : 0;
}

VdbDirectory nvdb_directory(const std::filesystem::path& path) {
  const NvdbDirectory file = read_nvdb_directory(path);
  VdbDirectory directory;
  directory.format = fmt::format("NanoVDB {}.{}", file.version_major, file.version_minor);
  directory.file_bytes = file.file_bytes;
  std::map<std::string, int> total, seen;
  for (const NvdbGridEntry& entry : file.grids) ++total[entry.name];
  for (const NvdbGridEntry& entry : file.grids) {
    VdbGridEntry grid;
    grid.base_name = entry.name;
    grid.name = total[entry.name] == 1 ? entry.name : fmt::format("{}[{}]", entry.name, seen[entry.name]++);
    grid.value_type = nvdb_value_type(entry.type);
    grid.grid_class = nvdb_class_name(entry.grid_class);
    grid.map_type = "AffineMap";
    grid.compression = compression_flags(entry.codec);
    directory.grids.push_back(std::move(grid));
  }
  return directory;
}

openvdb::GridBase::Ptr read_nvdb_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                      const VdbGridEntry& entry) {
  const NvdbDirectory file = read_nvdb_directory(path);
  for (size_t i = 0; i < directory.grids.size() && i < file.grids.size(); ++i) {
    if (directory.grids[i].name != entry.name) continue;
    require_memory(path.string(), fmt::format("grid \"{}\"", entry.name), 2 * file.grids[i].memory_bytes);
    return grid_from_nvdb(path, file.grids[i], read_nvdb_buffer(path, file.grids[i]));
  }
  throw Error(ErrorKind::file, path.string(), "has changed while it was being read");
}

}  // namespace

VdbDirectory read_volume_directory(const std::filesystem::path& path) {
  const VolumeFormat format = known_format(path);
  if (format == VolumeFormat::vdb) return read_vdb_directory(path);
  return format == VolumeFormat::nvdb ? nvdb_directory(path) : dense_directory(path, format);
}

openvdb::GridBase::Ptr read_volume_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                        const VdbGridEntry& entry) {
  const VolumeFormat format = known_format(path);
  if (format == VolumeFormat::vdb) return read_vdb_grid(path, directory, entry);
  if (format == VolumeFormat::nvdb) return read_nvdb_grid(path, directory, entry);
  const DenseVolume head = read_dense(path, format, DenseRead::head);
  constexpr uint64_t kBytesPerSample = 16;  // as read, put in order, and in the tree
  require_memory(path.string(), fmt::format("grid \"{}\"", entry.name),
                 kBytesPerSample * uint64_t(head.size.x) * uint64_t(head.size.y) * uint64_t(head.size.z) *
                     uint64_t(head.channels));
  return grid_from_dense(read_dense(path, format, DenseRead::all));
}

openvdb::MetaMap read_volume_metadata(const std::filesystem::path& path) {
  return known_format(path) == VolumeFormat::vdb ? read_vdb_metadata(path) : openvdb::MetaMap();
}

}  // namespace pileus
