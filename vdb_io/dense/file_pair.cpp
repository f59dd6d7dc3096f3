#include "vdb_io/dense/file_pair.h"

#include <fstream>

#include <zlib.h>

#include "lib/core/atomic_file.h"
#include "lib/core/error.h"
#include "vdb_io/dense/volume_header.h"

namespace pileus {
namespace {

void write_bytes(const AtomicFile& file, const std::string& bytes) {
  std::ofstream stream(file.path(), std::ios::binary);
  stream.write(bytes.data(), std::streamsize(bytes.size()));
  stream.close();
  if (!stream) throw Error(ErrorKind::file, file.target().string(), "cannot be written; is the disk full?");
}

uint32_t crc32_of(const std::string& bytes) {
  return uint32_t(::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

void write_with_header(const std::filesystem::path& path, const std::string& bytes, VolumeHeader header,
                       const std::string& pov_pattern) {
  header.crc32 = crc32_of(bytes);
  AtomicFile data(path), beside(header_path(path));
  write_bytes(data, bytes);
  write_bytes(beside, header_text(path, header, pov_pattern));
  beside.commit();
  data.commit();
}

}  // namespace pileus
