#pragma once

#include <filesystem>

namespace pileus {

/// A file that appears under its final name only when it is whole. The constructor creates an empty temporary
/// beside the target (same folder, so that renaming is atomic; same extension, so that writers which choose
/// a format by extension still do); the writer fills path(); commit() puts it in place. A temporary that was
/// never committed goes with the object, also when an exception passes by.
///
///   AtomicFile file("cloud.vdb");
///   write_grids(file.path());
///   file.commit();
///
/// A target that is a link stays one: the file that it points to is replaced.
/// errors: Error(file) where the folder is missing or not writable, where the target exists and is no regular
///         file, or (from commit) where the disk is full
class AtomicFile {
 public:
  explicit AtomicFile(const std::filesystem::path& target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::filesystem::path& path() const { return m_path; }      ///< the temporary: write here
  const std::filesystem::path& target() const { return m_target; }  ///< the final name, links resolved

  /// Flushes the temporary to the disk and renames it to the target. Call once, after the writer has closed.
  void commit();

 private:
  std::filesystem::path m_target;
  std::filesystem::path m_path;
  bool m_committed = false;
};

}  // namespace pileus
