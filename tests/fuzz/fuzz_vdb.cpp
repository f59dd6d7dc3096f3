// Any bytes as a .vdb file: reading it as a density, making a field of it and inspecting it either works or
// throws Error.
#include <cstddef>
#include <cstdint>

#include "lib/core/error.h"
#include "tests/fuzz/memory_file.h"
#include "vdb_io/inspect.h"
#include "vdb_io/openvdb/grid_to_field.h"
#include "vdb_io/openvdb/vdb_reader.h"

namespace pileus {
namespace {

void read(const std::filesystem::path& path) {
  try {
    const DensityGrid density =
        read_density_grid(path, {"", LevelSetPolicy::to_fog, BadValuePolicy::to_zero});
    field_from_grid(density.grid, Affine());
  } catch (const Error&) {
  }
}

void inspect(const std::filesystem::path& path) {
  try {
    inspect_vdb(path);
  } catch (const Error&) {
  }
}

}  // namespace
}  // namespace pileus

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  const pileus::MemoryFile file(bytes, size);
  pileus::read(file.path());
  pileus::inspect(file.path());
  return 0;
}
