// Any bytes as a .vdb file: reading it as a density, directly and with OpenVDB, making a field of it and
// inspecting it either works or throws Error.
#include <cstddef>
#include <cstdint>

#include "lib/core/error.h"
#include "tests/fuzz/memory_file.h"
#include "vdb_io/density_voxels.h"
#include "vdb_io/inspect.h"
#include "vdb_io/openvdb/grid_to_field.h"
#include "vdb_io/openvdb/vdb_reader.h"

namespace pileus {
namespace {

constexpr LevelSetPolicy kLevelSets = LevelSetPolicy::to_fog;
constexpr BadValuePolicy kBadValues = BadValuePolicy::to_zero;

void read(const std::filesystem::path& path) {
  try {
    field_from_voxels(read_density_voxels(path, {"", kLevelSets, kBadValues}).voxels, Affine());
  } catch (const Error&) {
  }
}

void read_with_openvdb(const std::filesystem::path& path) {
  try {
    field_from_grid(read_density_grid(path, {"", kLevelSets, kBadValues}).grid, Affine());
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
  pileus::read_with_openvdb(file.path());
  pileus::inspect(file.path());
  return 0;
}
