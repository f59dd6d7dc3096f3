#pragma once

#include <cstdint>

#include <openvdb/openvdb.h>

#include "lib/cloud/cloud_region.h"
#include "lib/math/vec.h"

namespace pileus {

/// A cube of voxels: a power of two along its edge, at a multiple of that.
struct VoxelNode {
  openvdb::Coord origin;
  int edge;
};

/// First and last voxel index along each axis whose centre lies in a box; none where first > last.
struct VoxelRange {
  openvdb::Coord first, last;

  int64_t count() const;

  /// How many voxels of another range, or of a node, lie in this one.
  int64_t count_in(const VoxelRange& other) const;
  int64_t count_in(const VoxelNode& node) const {
    return count_in(VoxelRange{node.origin, node.origin.offsetBy(node.edge - 1)});
  }
};

/// The nodes of a cloud on a grid: halves them until bounds of the density decide what they hold.
/// threads: const, safe from many threads
class CloudNodes {
 public:
  CloudNodes(const ProceduralCloud& cloud, double voxel_size, const VoxelRange& range)
      : m_cloud(cloud), m_voxel_size(voxel_size), m_range(range) {}

  const VoxelRange& range() const { return m_range; }

  /// The points of the voxels of a block [m].
  PointLattice points(const openvdb::Coord& first, const Vec3i& size) const;

  /// A box around the centres of the voxels of a node [m].
  Box3d box(const VoxelNode& node) const;

  /// Calls sink.empty(node), sink.full(node) (density 1) or sink.undecided(node, region) for parts of a node
  /// that cover it, in a fixed order; undecided ones have the edge `finest`.
  template <class Sink>
  void decide(const VoxelNode& node, int finest, Sink& sink) const {
    decide(node, CloudRegion(m_cloud, box(node)), finest, sink);
  }

 private:
  template <class Sink>
  void decide(const VoxelNode& node, const CloudRegion& region, int finest, Sink& sink) const {
    if (region.is_empty()) return sink.empty(node);
    if (region.is_full()) return sink.full(node);
    if (node.edge == finest) return sink.undecided(node, region);
    const int half = node.edge / 2;
    for (int child = 0; child < 8; ++child) {
      const VoxelNode part{
          node.origin + openvdb::Coord(half * (child >> 2), half * (child >> 1 & 1), half * (child & 1)),
          half};
      if (m_range.count_in(part) == 0) continue;
      decide(part, region.within(box(part)), finest, sink);
    }
  }

  const ProceduralCloud& m_cloud;
  double m_voxel_size;
  VoxelRange m_range;
};

}  // namespace pileus
