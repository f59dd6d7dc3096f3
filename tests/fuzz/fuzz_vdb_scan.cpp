// Any bytes as a .vdb file, before OpenVDB: the directory and the trees of all its grids are walked, or there
// is an Error. Many times as fast as the target vdb.
#include <cstddef>
#include <cstdint>

#include "lib/core/error.h"
#include "tests/fuzz/memory_file.h"
#include "vdb_io/vdb_directory.h"
#include "vdb_io/vdb_structure.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  const pileus::MemoryFile file(bytes, size);
  try {
    for (const auto& grid : pileus::read_vdb_directory(file.path()).grids) {
      try {
        pileus::check_grid_structure(file.path(), grid);
      } catch (const pileus::Error&) {
      }
    }
  } catch (const pileus::Error&) {
  }
  return 0;
}
