#pragma once

#include <cstdint>
#include <vector>

#include "lib/core/large_array.h"
#include "lib/math/affine.h"
#include "lib/math/vec.h"

namespace pileus {

/// Optical depths towards a sun through one grid, on a sheared lattice whose w axis runs towards the sun; see
/// sun_lattice.h. Beyond the lattice the value of its border holds.
///
/// Nodes lie in bricks of 8^3 cells with the 9^3 nodes at their corners, as densities do: bricks that nobody
/// reads, or that are all alike, share one. A node takes 16 bits: 4 of an exponent and 12 of a mantissa, of
/// the depth + 1/8, so that its relative error is 2^-13 and nodes may be slightly negative. That changes the
/// light by less than 5e-5, and by a third of that on average.
struct SunLattice {
  static constexpr int kBrickCells = 8;
  static constexpr int kStrideU = 81, kStrideW = 9, kStrideV = 1;  ///< between neighbours in a brick
  static constexpr int kPitch = 736;                               ///< from one brick's nodes to the next's
  static constexpr int kMantissaShift = 11;                        ///< of a float's bits
  static constexpr int32_t kExponentBias = (127 - 6) << 23;
  static constexpr float kLowest = -0.1f, kOffset = 0.125f, kDeepest = 1000.0f;

  Affine lattice_from_world;
  Vec3i bricks{0, 0, 0};         ///< along u, v, w
  std::vector<int32_t> offsets;  ///< [bu][bv][bw]: where a brick's nodes begin
  LargeArray<uint16_t> nodes;    ///< [u][w][v] of each brick
  int64_t used = 0;              ///< bricks that are stored

  size_t memory_bytes() const { return offsets.size() * sizeof(int32_t) + size_t(used) * kPitch * 2; }
};

}  // namespace pileus
