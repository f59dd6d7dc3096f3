#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "lib/math/vec.h"

namespace pileus {

/// 8^3 voxels as OpenVDB stores them: x strides 64, y 8, z 1.
struct VoxelLeaf {
  Vec3i origin;  ///< a multiple of 8
  const float* values;
};

/// A cube of voxels of one value: 8, 128 or 4096 of them along its edge, at multiples of that.
struct VoxelTile {
  Vec3i origin;
  int size;
  float value;
};

/// Cells that voxels reach: each is a corner of the cells below it, too.
class CellBounds {
 public:
  /// A cube of voxels. errors: Error(failed) where it lies within 2^13 of the ends of the integers
  void extend(const Vec3i& origin, int size);

  /// [lo, hi); both 0 where nothing was added.
  Vec3i lo() const { return m_is_empty ? Vec3i(0) : m_lo; }
  Vec3i hi() const { return m_is_empty ? Vec3i(0) : m_hi; }

 private:
  bool m_is_empty = true;
  Vec3i m_lo{0, 0, 0}, m_hi{0, 0, 0};
};

/// What one look at the values of leaves tells.
struct LeafScan {
  std::vector<uint8_t> reached;  ///< of each leaf: VoxelSource::reached
  float max_value = 0.0f;
};

/// The voxels of a grid where they were made or read, and what one look at all of them tells. Bricks of any
/// kind are built from here, when somebody asks for them.
class VoxelSource {
 public:
  /// Leaves and tiles do not overlap; their values are finite and >= 0.
  ///   owner: keeps the leaves' values alive
  /// errors: those of CellBounds
  VoxelSource(std::vector<VoxelLeaf> leaves, std::vector<VoxelTile> tiles,
              std::shared_ptr<const void> owner = nullptr);

  /// The same where somebody has looked at the leaves already: the scan has an entry for each.
  VoxelSource(std::vector<VoxelLeaf> leaves, std::vector<VoxelTile> tiles, std::shared_ptr<const void> owner,
              LeafScan scan);

  std::span<const VoxelLeaf> leaves() const { return m_leaves; }
  std::span<const VoxelTile> tiles() const { return m_tiles; }

  /// Which bricks a leaf's voxels reach that are not 0; bit dx + 2 dy + 4 dz: they are corners of cells in
  /// the brick at -(dx, dy, dz).
  uint8_t reached(size_t leaf) const { return m_scan.reached[leaf]; }

  float max_value() const { return m_scan.max_value; }
  const CellBounds& bounds() const { return m_bounds; }  ///< of what is not 0

 private:
  std::vector<VoxelLeaf> m_leaves;
  std::vector<VoxelTile> m_tiles;
  std::shared_ptr<const void> m_owner;
  LeafScan m_scan;
  CellBounds m_bounds;
};

}  // namespace pileus
