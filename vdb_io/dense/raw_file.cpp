#include "lib/core/error.h"
#include "vdb_io/dense/dense_files.h"
#include "vdb_io/dense/file_pair.h"
#include "vdb_io/file_cursor.h"

namespace pileus {

DenseVolume read_raw(const std::filesystem::path& path, DenseRead what) {
  FileCursor file(path);
  const auto header = read_volume_header(path);
  if (!header || !header->size) {
    file.fail(
        fmt::format("holds samples and nothing else; expected their size and type in {} (docs/formats.md "
                    "shows one)",
                    header_path(path).filename().string()));
  }
  DenseVolume volume;
  volume.header = *header;
  volume.size = *header->size;
  volume.channels = header->channels;
  try {
    volume.stored = sample_type_named(header->type);
  } catch (const Error& error) {
    throw Error(ErrorKind::file, header_path(path).string(), error.diagnostics().front().message);
  }
  const uint64_t x = uint64_t(volume.size.x), y = uint64_t(volume.size.y), z = uint64_t(volume.size.z);
  const uint64_t channels = uint64_t(volume.channels);
  const uint64_t count = checked_count(file, {x, y, z, channels}, bytes_of(volume.stored));
  if (file.remaining() != count * bytes_of(volume.stored)) {
    file.fail(fmt::format("has {} bytes; {} x {} x {} samples of {} channels and type {} are {}", file.size(),
                          x, y, z, channels, header->type, count * bytes_of(volume.stored)));
  }
  check_header_fits(path, *header, volume.size, volume.channels, what == DenseRead::all);
  if (what == DenseRead::head) return volume;
  Samples in_file = read_samples(file, volume.stored, header->big_endian, count);
  const SampleSteps z_fastest{y * z * channels, z * channels, channels, 1};
  volume.samples = header->z_fastest ? arranged(std::move(in_file), volume.size, volume.channels, z_fastest)
                                     : std::move(in_file);
  return volume;
}

void write_raw(const std::filesystem::path& path, const DenseVolume& volume) {
  VolumeHeader header = volume.header;
  header.type = name_of(volume.stored);
  header.big_endian = header.z_fastest = false;
  header.size = volume.size;
  header.channels = volume.channels;
  header.value_scale.reset();
  write_with_header(path, stored_bytes(volume.samples, volume.stored), header);
}

}  // namespace pileus
