#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "lib/math/ray.h"
#include "lib/volume/brick_pyramid.h"

namespace pileus {

/// Bounds of how much the trilinear field of a brick grid bends, for those who must prove how far a linear
/// interpolation of its integrals can be wrong.
///
/// Around every voxel lies its neighbourhood, the 2^3 cells that have it as a corner. In it the field's
/// gradient jumps across the three voxel planes through the voxel, and its mixed derivatives are bounded in
/// the cells; both come from differences of voxel values. Stored rounded up, 12 bytes per voxel, where they
/// are not 0.
///
/// Local space is that of the pyramid: cells, relative to its origin.
class CurvatureGrid {
 public:
  /// Reads the grid behind the pyramid. Uses parallel_for.
  /// errors: Error(failed) where that needs more than half of the machine's memory
  explicit CurvatureGrid(const BrickPyramid& pyramid);

  /// Let g(s) be the density at the point q(r) + s * step, s in [-1/2, 1/2]. Returns an upper bound of the
  /// integral over r >= 0 of the total variation of dg/ds, where q(r) = line.o + r * line.d.
  ///   line:  local space; d need not have unit length, and is not 0
  ///   step:  local space, of any length
  double variation_along(const Ray& line, const Vec3d& step) const;

  size_t memory_bytes() const { return m_values.size() * sizeof(Bounds) + m_bricks.size() * sizeof(int32_t); }

 private:
  /// In the neighbourhood of one voxel, as the upper halves of floats.
  struct Bounds {
    std::array<uint16_t, 3> kink{};   ///< [axis] |jump of the derivative along it| across the voxel's plane
    std::array<uint16_t, 3> mixed{};  ///< [axis] |mixed derivative by the other two|
  };
  using Brick = std::array<Bounds, 512>;

  static constexpr int32_t kFlat = -1;

  bool is_flat(const Vec3i& brick) const;
  bool fill_brick(const Vec3i& brick, Brick& bounds) const;
  double variation_of_short_step(const Ray& line, const Vec3d& step) const;

  size_t index_of(const Vec3i& brick) const {
    return (size_t(brick.x) * size_t(m_size.y) + size_t(brick.y)) * size_t(m_size.z) + size_t(brick.z);
  }

  const BrickPyramid* m_pyramid;
  Vec3i m_size{0, 0, 0};          ///< bricks of 8^3 voxels
  std::vector<int32_t> m_bricks;  ///< [x][y][z]: brick of m_values, or kFlat
  std::vector<Bounds> m_values;
};

}  // namespace pileus
