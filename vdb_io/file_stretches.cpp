#include "vdb_io/file_stretches.h"

#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "lib/core/error.h"

namespace pileus {

FileStretches::FileStretches(std::filesystem::path path)
    : m_path(std::move(path)), m_descriptor(::open(m_path.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (m_descriptor < 0)
    throw Error(ErrorKind::file, m_path.string(), "cannot be opened for reading; check its permissions");
}

FileStretches::~FileStretches() {
  ::close(m_descriptor);
}

void FileStretches::read(uint64_t begin, std::span<char> bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = ::pread(m_descriptor, bytes.data(), bytes.size(), off_t(begin));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      throw Error(ErrorKind::file, m_path.string(),
                  "cannot be read (it changed while it was being read, or the disk failed)");
    }
    begin += uint64_t(count);
    bytes = bytes.subspan(size_t(count));
  }
}

}  // namespace pileus
