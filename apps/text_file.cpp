#include "apps/text_file.h"

#include <cstdio>

#include "lib/core/atomic_file.h"
#include "lib/core/error.h"

namespace pileus {

void write_text(const std::filesystem::path& path, const std::string& text) {
  AtomicFile file(path);
  std::FILE* stream = std::fopen(file.path().c_str(), "wb");
  const bool is_whole = stream && std::fwrite(text.data(), 1, text.size(), stream) == text.size();
  const bool is_closed = stream && std::fclose(stream) == 0;
  if (!is_whole || !is_closed) throw Error(ErrorKind::file, path.string(), "cannot be written");
  file.commit();
}

}  // namespace pileus
