#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace pileus {

/// Reads stretches of a file, from as many threads as like to. The file is not mapped: one that shrinks
/// meanwhile gives an error, and does not end the process.
class FileStretches {
 public:
  explicit FileStretches(std::filesystem::path path);
  ~FileStretches();
  FileStretches(const FileStretches&) = delete;
  FileStretches& operator=(const FileStretches&) = delete;

  /// Fills `bytes` from `begin` on. errors: Error(file) where the file ends before that
  void read(uint64_t begin, std::span<char> bytes) const;

 private:
  std::filesystem::path m_path;
  int m_descriptor;
};

}  // namespace pileus
