#include "vdb_io/openvdb/cloud_nodes.h"

#include <algorithm>

namespace pileus {

int64_t VoxelRange::count() const {
  int64_t count = 1;
  for (int axis = 0; axis < 3; ++axis) count *= int64_t(last[axis]) - first[axis] + 1;
  return count;
}

int64_t VoxelRange::count_in(const VoxelRange& other) const {
  int64_t count = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int lo = std::max(first[axis], other.first[axis]), hi = std::min(last[axis], other.last[axis]);
    count *= std::max(0, hi - lo + 1);
  }
  return count;
}

PointLattice CloudNodes::points(const openvdb::Coord& first, const Vec3i& size) const {
  return {m_voxel_size * Vec3d(first.x(), first.y(), first.z()), Vec3d(m_voxel_size), size};
}

Box3d CloudNodes::box(const VoxelNode& node) const {
  const openvdb::Coord &o = node.origin, last = node.origin.offsetBy(node.edge - 1);
  return {m_voxel_size * Vec3d(o.x(), o.y(), o.z()), m_voxel_size * Vec3d(last.x(), last.y(), last.z())};
}

}  // namespace pileus
