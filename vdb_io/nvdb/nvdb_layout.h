#pragma once

#include <cstdint>

#include <nanovdb/NanoVDB.h>

namespace pileus {

/// What stands in front of a segment of a NanoVDB file, and before each of its grids (NanoVDB's util/IO.h has
/// the same behind a heavy header).
struct NvdbSegmentHead {
  uint64_t magic;
  uint32_t version;
  uint16_t grid_count;
  uint16_t codec;
};
static_assert(sizeof(NvdbSegmentHead) == 16);

struct NvdbGridHead {
  uint64_t memory_bytes, file_bytes, name_hash, active_voxels;
  uint32_t type, grid_class;
  double world_bounds[6];
  int32_t index_bounds[6];
  double voxel_size[3];
  uint32_t name_bytes;  ///< the closing 0 included
  uint32_t node_counts[4], tile_counts[3];
  uint16_t codec, padding;
  uint32_t version;
};
static_assert(sizeof(NvdbGridHead) == 176);

/// "NanoVDB0", "NanoVDB1" (a grid) and "NanoVDB2" (a file), the latter two since NanoVDB 32.6.
constexpr uint64_t kNvdbMagic = 0x304244566f6e614eu, kNvdbMagicGrid = 0x314244566f6e614eu,
                   kNvdbMagicFile = 0x324244566f6e614eu;
constexpr uint32_t kNvdbLayout = 32;  ///< the major version

inline uint32_t nvdb_major(uint32_t version) {
  return version >> 21;
}
inline uint32_t nvdb_minor(uint32_t version) {
  return version >> 10 & 0x7ff;
}

}  // namespace pileus
