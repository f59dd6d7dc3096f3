#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>

namespace pileus {

/// The chunks of a PNG file, one after the other, read piece by piece. ref: ISO/IEC 15948, 5
class PngChunks {
 public:
  /// Begins before the first chunk, if is_open().
  explicit PngChunks(const std::filesystem::path& file);

  /// True for a file that can be read and begins as a PNG file does.
  bool is_open() const { return m_is_open; }

  /// Goes on to the next chunk: false where the file ends, or the present one is cut short or its check sum
  /// differs.
  bool next();
  std::string_view name() const { return {m_name.data(), m_name.size()}; }
  uint32_t size() const { return m_size; }

  /// Reads up to `most` of the bytes of the chunk that are left; returns how many.
  size_t read(uint8_t* to, size_t most);

  /// Reads what is left of the present chunk: false where it is cut short or its check sum differs.
  bool finish();

 private:
  bool read_number(uint32_t& number);

  std::unique_ptr<std::FILE, int (*)(std::FILE*)> m_file;
  bool m_is_open = false, m_is_inside = false;
  std::array<char, 4> m_name{};
  uint32_t m_size = 0, m_left = 0;  ///< [bytes]
  uint32_t m_sum = 0;               ///< of the name and of what has been read
};

}  // namespace pileus
