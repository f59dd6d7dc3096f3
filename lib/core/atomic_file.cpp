#include "lib/core/atomic_file.h"

#include <atomic>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "lib/core/error.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

std::string errno_text(int code) {
  return std::generic_category().message(code);
}

/// The file that writing to `target` means: what a link points to, and never a device or a folder.
fs::path resolve_target(const fs::path& target) {
  std::error_code error;
  const fs::path resolved = fs::weakly_canonical(target, error);
  if (error || !resolved.has_filename()) {
    throw Error(ErrorKind::file, target.string(), "cannot be written; expected a file name in a folder");
  }
  const fs::file_status status = fs::status(resolved, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    const char* found = fs::is_directory(status) ? "is a folder" : "is no regular file";
    throw Error(ErrorKind::file, target.string(), fmt::format("{}; expected the name of a file", found));
  }
  return resolved;
}

/// Creates the temporary with the permissions that a new file gets (umask applies). The process id keeps two
/// processes apart and the counter two threads; O_EXCL decides where a name is taken all the same.
fs::path create_temporary(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  for (;;) {
    fs::path path = target;
    path.replace_filename(fmt::format("{}.partial-{}-{}{}", target.stem().string(), ::getpid(), counter++,
                                      target.extension().string()));
    const int file = ::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
    if (file >= 0) {
      ::close(file);
      return path;
    }
    if (errno == EEXIST) continue;
    throw Error(ErrorKind::file, target.string(),
                fmt::format("no file can be created in {} ({}); expected a writable folder",
                            target.parent_path().string(), errno_text(errno)));
  }
}

/// Forces what was written to `path` (a file or a folder) to the disk; returns 0 or errno.
int sync_to_disk(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return errno;
  const int code = ::fsync(file) == 0 ? 0 : errno;
  ::close(file);
  return code;
}

}  // namespace

AtomicFile::AtomicFile(const fs::path& target)
    : m_target(resolve_target(target)), m_path(create_temporary(m_target)) {}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  if (!m_committed) fs::remove(m_path, ignored);
}

void AtomicFile::commit() {
  PILEUS_CHECK(!m_committed);
  if (const int code = sync_to_disk(m_path)) {
    throw Error(ErrorKind::file, m_target.string(), fmt::format("cannot be written: {}", errno_text(code)));
  }
  std::error_code error;
  fs::rename(m_path, m_target, error);
  if (error) {
    throw Error(ErrorKind::file, m_target.string(),
                fmt::format("the finished file cannot be put in place: {}", error.message()));
  }
  m_committed = true;
  // The name itself is on the disk once the folder is. Some file systems cannot sync a folder; the file is
  // whole in any case.
  const fs::path folder = m_target.parent_path();
  (void)sync_to_disk(folder.empty() ? fs::path(".") : folder);
}

}  // namespace pileus
