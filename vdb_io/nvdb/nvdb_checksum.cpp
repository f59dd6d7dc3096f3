#include "vdb_io/nvdb/nvdb_checksum.h"

#include <algorithm>

#include <zlib.h>

namespace pileus {
namespace {

constexpr uint64_t kNone = 0xffffffffu;  ///< "not computed", in either half
constexpr uint64_t kUncovered = 16;      ///< magic and checksum themselves [bytes]

uint64_t crc(const void* data, uint64_t bytes) {
  return ::crc32_z(0, static_cast<const Bytef*>(data), bytes);
}

uint64_t crc_of_head(const NvdbBuffer& buffer, const NvdbNodes& nodes) {
  return crc(buffer.data() + kUncovered, std::min(nodes.head_bytes, buffer.size()) - kUncovered);
}

uint64_t crc_of_nodes(const NvdbBuffer& buffer, const NvdbNodes& nodes) {
  std::vector<uint64_t> crcs;
  const auto add = [&](const std::vector<uint64_t>& offsets, uint64_t bytes) {
    for (const uint64_t offset : offsets) crcs.push_back(crc(buffer.data() + offset, bytes));
  };
  add(nodes.upper, nodes.upper_bytes);
  add(nodes.lower, nodes.lower_bytes);
  add(nodes.leaves, nodes.leaf_bytes);
  return crc(crcs.data(), crcs.size() * sizeof(uint64_t));
}

}  // namespace

uint64_t nvdb_checksum(const NvdbBuffer& buffer, const NvdbNodes& nodes) {
  const bool is_empty = nodes.upper.empty() && nodes.lower.empty() && nodes.leaves.empty();
  const uint64_t tail = is_empty ? kNone : crc_of_nodes(buffer, nodes);
  return tail << 32 | crc_of_head(buffer, nodes);
}

bool nvdb_checksum_agrees(uint64_t stored, const NvdbBuffer& buffer, const NvdbNodes& nodes) {
  const uint64_t head = stored & kNone, tail = stored >> 32;
  if (head != kNone && head != crc_of_head(buffer, nodes)) return false;
  return tail == kNone || tail == crc_of_nodes(buffer, nodes);
}

}  // namespace pileus
