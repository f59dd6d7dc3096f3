#pragma once

#include <cstdint>
#include <vector>

#include "vdb_io/nvdb/nvdb_file.h"

namespace pileus {

/// Where the nodes of a grid lie in its memory image: each level in the order of the tree.
struct NvdbNodes {
  std::vector<uint64_t> upper, lower, leaves;                 ///< offsets [bytes]
  uint64_t upper_bytes = 0, lower_bytes = 0, leaf_bytes = 0;  ///< of the fixed part of a node
  uint64_t head_bytes = 0;                                    ///< grid, tree and root together
};

/// The pair of CRC-32s of NanoVDB 32.0 to 32.5: of the head (without magic and checksum) in the low half, of
/// the CRCs of all nodes in the high half. An empty tree has no second one: all bits are set there.
uint64_t nvdb_checksum(const NvdbBuffer& buffer, const NvdbNodes& nodes);

/// True where the stored checksum is the buffer's, as far as it was computed at all.
bool nvdb_checksum_agrees(uint64_t stored, const NvdbBuffer& buffer, const NvdbNodes& nodes);

}  // namespace pileus
