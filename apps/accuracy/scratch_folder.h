#pragma once

#include <filesystem>
#include <system_error>

#include <stdlib.h>

#include "lib/core/error.h"

namespace pileus {

/// A fresh folder among the temporary ones; it goes with the object.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "pileus-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw Error(ErrorKind::file, name, "no temporary folder can be made");
    m_path = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(m_path, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  std::filesystem::path operator/(const std::filesystem::path& name) const { return m_path / name; }

 private:
  std::filesystem::path m_path;
};

}  // namespace pileus
