#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <type_traits>
#include <vector>

namespace pileus {

/// Reads a binary file front to back and never past its end: every read and skip is checked against the size
/// of the file before anything is allocated. Small skips cost nothing, because a window of the file is held.
/// errors: Error(file) that says what was being read, where, and how many bytes are left
class FileCursor {
 public:
  explicit FileCursor(std::filesystem::path path);

  uint64_t size() const { return m_size; }
  uint64_t position() const { return m_position; }
  uint64_t remaining() const { return m_limit - m_position; }

  /// Goes to `position`; from there nothing at or after `limit` is readable. position <= limit <= size().
  void enter(uint64_t position, uint64_t limit);

  void skip(uint64_t bytes, const char* what);
  void read(void* target, size_t bytes, const char* what);

  /// A little-endian number or another plain value, as OpenVDB stores it.
  template <class T>
  T get(const char* what) {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    read(&value, sizeof value, what);
    return value;
  }

  /// A string with a 32-bit length before it, of at most `most` bytes.
  std::string get_string(const char* what, uint32_t most);

  /// Throws Error(file) for this file.
  [[noreturn]] void fail(const std::string& message) const;

 private:
  void require(uint64_t bytes, const char* what) const;

  std::filesystem::path m_path;
  std::ifstream m_stream;
  uint64_t m_size = 0;
  uint64_t m_limit = 0;
  uint64_t m_position = 0;
  std::vector<char> m_window;  ///< bytes [m_window_begin, m_window_begin + m_window.size()) of the file
  uint64_t m_window_begin = 0;
};

}  // namespace pileus
