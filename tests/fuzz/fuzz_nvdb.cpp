// Any bytes as a .nvdb file: its grids are found, unpacked and made OpenVDB's, or there is an Error.
#include <cstddef>
#include <cstdint>

#include "lib/core/error.h"
#include "tests/fuzz/memory_file.h"
#include "vdb_io/nvdb/nvdb_file.h"
#include "vdb_io/openvdb/nvdb_grids.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  const pileus::MemoryFile file(bytes, size);
  try {
    for (const auto& grid : pileus::read_nvdb_directory(file.path()).grids)
      pileus::grid_from_nvdb(file.path(), grid, pileus::read_nvdb_buffer(file.path(), grid));
  } catch (const pileus::Error&) {
  }
  return 0;
}
