#include "lib/image/png_chunks.h"

#include <algorithm>

#include <isa-l/crc.h>

namespace pileus {

PngChunks::PngChunks(const std::filesystem::path& file)
    : m_file(std::fopen(file.c_str(), "rb"), std::fclose) {
  constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
  std::array<char, kSignature.size()> start{};
  m_is_open = m_file && std::fread(start.data(), 1, start.size(), m_file.get()) == start.size() &&
              std::string_view(start.data(), start.size()) == kSignature;
}

bool PngChunks::next() {
  if (m_is_inside && !finish()) return false;
  if (!read_number(m_size) || std::fread(m_name.data(), 1, m_name.size(), m_file.get()) != m_name.size())
    return false;
  m_is_inside = true;
  m_left = m_size;
  m_sum = crc32_gzip_refl(0, reinterpret_cast<const uint8_t*>(m_name.data()), m_name.size());
  return true;
}

size_t PngChunks::read(uint8_t* to, size_t most) {
  const size_t count = std::fread(to, 1, std::min(most, size_t(m_left)), m_file.get());
  m_left -= uint32_t(count);
  m_sum = crc32_gzip_refl(m_sum, to, count);
  return count;
}

bool PngChunks::finish() {
  m_is_inside = false;
  std::array<uint8_t, 4096> rest{};
  while (m_left > 0) {
    if (read(rest.data(), rest.size()) == 0) return false;
  }
  uint32_t sum = 0;
  return read_number(sum) && sum == m_sum;
}

bool PngChunks::read_number(uint32_t& number) {
  std::array<uint8_t, 4> bytes{};
  if (std::fread(bytes.data(), 1, bytes.size(), m_file.get()) != bytes.size()) return false;
  number = 0;
  for (const uint8_t byte : bytes) number = number << 8 | byte;
  return true;
}

}  // namespace pileus
