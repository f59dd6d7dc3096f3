#include "vdb_io/file_cursor.h"

#include <algorithm>
#include <cstring>
#include <system_error>

#include "lib/core/error.h"

namespace pileus {
namespace {

constexpr uint64_t kWindowBytes = 1 << 18;

}  // namespace

FileCursor::FileCursor(std::filesystem::path path) : m_path(std::move(path)) {
  std::error_code failure;
  const auto status = std::filesystem::status(m_path, failure);
  if (!std::filesystem::exists(status)) fail("no such file");
  if (!std::filesystem::is_regular_file(status)) fail("is not a regular file; expected an OpenVDB file");
  m_size = std::filesystem::file_size(m_path, failure);
  m_stream.open(m_path, std::ios::binary);
  if (failure || !m_stream) fail("cannot be opened for reading; check its permissions");
  m_limit = m_size;
}

void FileCursor::enter(uint64_t position, uint64_t limit) {
  PILEUS_CHECK(position <= limit && limit <= m_size);
  m_position = position;
  m_limit = limit;
}

void FileCursor::skip(uint64_t bytes, const char* what) {
  require(bytes, what);
  m_position += bytes;
}

void FileCursor::read(void* target, size_t bytes, const char* what) {
  require(bytes, what);
  char* out = static_cast<char*>(target);
  while (bytes > 0) {
    const uint64_t window_end = m_window_begin + m_window.size();
    if (m_position < m_window_begin || m_position >= window_end) {
      m_window.resize(std::min(kWindowBytes, m_size - m_position));
      m_window_begin = m_position;
      m_stream.seekg(std::streamoff(m_position));
      if (!m_stream.read(m_window.data(), std::streamsize(m_window.size()))) {
        fail("cannot be read (it changed while it was being read, or the disk failed)");
      }
      continue;
    }
    const size_t count = std::min<uint64_t>(bytes, window_end - m_position);
    std::memcpy(out, m_window.data() + (m_position - m_window_begin), count);
    out += count;
    m_position += count;
    bytes -= count;
  }
}

std::string FileCursor::get_string(const char* what, uint32_t most) {
  const auto length = get<uint32_t>(what);
  require(length, what);
  if (length > most) {
    fail(fmt::format("is damaged: {} of {} bytes at byte {}; expected at most {}", what, length, m_position,
                     most));
  }
  std::string text(length, '\0');
  read(text.data(), length, what);
  return text;
}

void FileCursor::fail(const std::string& message) const {
  throw Error(ErrorKind::file, m_path.string(), message);
}

void FileCursor::require(uint64_t bytes, const char* what) const {
  if (bytes <= remaining()) return;
  fail(fmt::format("is damaged or cut short: {} at byte {} needs {} bytes, {} are left; fetch the file again",
                   what, m_position, bytes, remaining()));
}

}  // namespace pileus
