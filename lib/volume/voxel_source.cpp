#include "lib/volume/voxel_source.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/volume/kernels/leaf_kernels.h"

namespace pileus {

void CellBounds::extend(const Vec3i& origin, int size) {
  constexpr int kMargin = 1 << 13, kLowest = std::numeric_limits<int>::min() + kMargin,
                kHighest = std::numeric_limits<int>::max() - kMargin;
  for (int axis = 0; axis < 3; ++axis) {
    if (origin[axis] < kLowest || origin[axis] > kHighest) {
      throw Error(ErrorKind::failed, SourceLoc{},
                  fmt::format("voxels at ({}, {}, {}); expected indices from {} to {}", origin.x, origin.y,
                              origin.z, kLowest, kHighest));
    }
  }
  const Vec3i lo = origin - Vec3i(1), hi = origin + Vec3i(size);
  for (int axis = 0; axis < 3; ++axis) {
    m_lo[axis] = m_is_empty ? lo[axis] : std::min(m_lo[axis], lo[axis]);
    m_hi[axis] = m_is_empty ? hi[axis] : std::max(m_hi[axis], hi[axis]);
  }
  m_is_empty = false;
}

namespace {

LeafScan scan_all(std::span<const VoxelLeaf> leaves) {
  LeafScan scan;
  scan.reached.resize(leaves.size());
  constexpr size_t kLeavesPerTask = 256;
  std::vector<float> largest((leaves.size() + kLeavesPerTask - 1) / kLeavesPerTask);
  parallel_for(largest.size(), [&](size_t task) {
    const size_t first = task * kLeavesPerTask, count = std::min(kLeavesPerTask, leaves.size() - first);
    largest[task] = scan_leaves(leaves.subspan(first, count), scan.reached.data() + first);
  });
  for (const float value : largest) scan.max_value = std::max(scan.max_value, value);
  return scan;
}

}  // namespace

VoxelSource::VoxelSource(std::vector<VoxelLeaf> leaves, std::vector<VoxelTile> tiles,
                         std::shared_ptr<const void> owner)
    : VoxelSource(std::move(leaves), std::move(tiles), std::move(owner), {}) {}

VoxelSource::VoxelSource(std::vector<VoxelLeaf> leaves, std::vector<VoxelTile> tiles,
                         std::shared_ptr<const void> owner, LeafScan scan)
    : m_leaves(std::move(leaves)),
      m_tiles(std::move(tiles)),
      m_owner(std::move(owner)),
      m_scan(std::move(scan)) {
  if (m_scan.reached.size() != m_leaves.size()) m_scan = scan_all(m_leaves);
  for (size_t i = 0; i < m_leaves.size(); ++i) {
    if (m_scan.reached[i] != 0) m_bounds.extend(m_leaves[i].origin, 8);
  }
  for (const VoxelTile& tile : m_tiles) {
    if (!(tile.value > 0.0f)) continue;
    m_bounds.extend(tile.origin, tile.size);
    m_scan.max_value = std::max(m_scan.max_value, tile.value);
  }
}

}  // namespace pileus
