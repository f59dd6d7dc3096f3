// Any bytes as a .vdb file, without OpenVDB: the directory is read, the scalar grids with all their voxels,
// and the trees of the others are walked; or there is an Error. Many times as fast as the target vdb.
#include <cstddef>
#include <cstdint>

#include "lib/core/error.h"
#include "tests/fuzz/memory_file.h"
#include "vdb_io/vdb_structure.h"
#include "vdb_io/vdb_voxels.h"

namespace pileus {
namespace {

void read_grid(const std::filesystem::path& path, const VdbDirectory& directory, const VdbGridEntry& grid) {
  try {
    if (grid.is_scalar()) {
      read_vdb_voxels(path, directory, grid);
    } else {
      check_grid_structure(path, grid);
    }
  } catch (const Error&) {
  }
}

}  // namespace
}  // namespace pileus

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  const pileus::MemoryFile file(bytes, size);
  try {
    const pileus::VdbDirectory directory = pileus::read_vdb_directory(file.path());
    for (const auto& grid : directory.grids) pileus::read_grid(file.path(), directory, grid);
  } catch (const pileus::Error&) {
  }
  return 0;
}
