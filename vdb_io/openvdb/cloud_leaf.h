#pragma once

#include <array>
#include <span>

#include "vdb_io/openvdb/build_cloud.h"
#include "vdb_io/openvdb/cloud_nodes.h"

namespace pileus {

/// The densities of a leaf of 8^3 voxels that bounds have left undecided. They are asked once more for its
/// eight parts of 4^3, so that what lies along the surface is not evaluated to both sides of it.
/// threads: const, safe from many threads; what it is made of must outlive it
class CloudLeaf {
 public:
  static constexpr int kEdge = 8, kPartEdge = kEdge / 2;
  static constexpr size_t kVoxels = kEdge * kEdge * kEdge;

  /// region: the cloud in the box of the leaf
  CloudLeaf(const CloudNodes& nodes, const VoxelNode& leaf, const CloudRegion& region);

  /// rho: z fastest, as in a leaf of a VDB tree; 0 outside the range of the nodes
  void evaluate(std::array<float, kVoxels>& rho, CloudBuildCounters& counters) const;

 private:
  enum class Part { outside, empty, full, undecided };

  /// Number of a part: that of its place along x, y and z, 0 or 1 each, z fastest.
  VoxelNode part(size_t number) const;
  void count(CloudBuildCounters& counters) const;
  void fill_block(const openvdb::Coord& first, const Vec3i& size, std::span<const float> values,
                  std::array<float, kVoxels>& rho) const;
  void evaluate_block(const openvdb::Coord& first, const Vec3i& size, std::array<float, kVoxels>& rho,
                      CloudBuildCounters& counters) const;

  const CloudNodes& m_nodes;
  VoxelNode m_leaf;
  const CloudRegion& m_region;
  std::array<Part, 8> m_parts;
};

}  // namespace pileus
