#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

namespace pileus {

/// A file that lives in memory, for readers that want a path.
class MemoryFile {
 public:
  MemoryFile(const uint8_t* bytes, size_t size) : m_descriptor(memfd_create("fuzz", 0)) {
    if (m_descriptor < 0 || write(m_descriptor, bytes, size) != ssize_t(size)) {
      throw std::runtime_error("no file can be made in memory");
    }
  }
  ~MemoryFile() { close(m_descriptor); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(m_descriptor); }

 private:
  int m_descriptor;
};

}  // namespace pileus
