#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "lib/math/vec.h"

namespace pileus::bench {

/// A density grid as the plain marcher reads it: every voxel of the bounding box in one array, and a bit of
/// empty space skipping. Positions are in voxels of the array; voxel (i, j, k) sits at the integer position
/// (i, j, k). A border of empty voxels lies around the grid's own: one in front, two behind, so that a
/// look-up at 0 <= p <= size - 2 needs no check.
struct DenseGrid {
  static constexpr int kBlock = 8;  ///< cells along a block's edge

  Vec3i size{0, 0, 0};       ///< voxels per axis, border included
  Vec3i blocks{0, 0, 0};     ///< blocks per axis
  Vec3d origin;              ///< world-space position of voxel (0, 0, 0) [m]
  double voxel_size = 0.0;   ///< [m]
  std::vector<float> rho;    ///< rho[nz][ny][nx]
  std::vector<uint8_t> lit;  ///< lit[bz][by][bx]: 1 where a cell of the block has a corner > 0

  size_t index(int x, int y, int z) const {
    return (size_t(z) * size_t(size.y) + size_t(y)) * size_t(size.x) + size_t(x);
  }
  size_t block_index(int x, int y, int z) const {
    return (size_t(z) * size_t(blocks.y) + size_t(y)) * size_t(blocks.x) + size_t(x);
  }
};

/// Reads the density grid of a `.vdb` file; `lit` is left empty.
/// errors: Error(file) as the reader of vdb_io; also where voxels are no cubes along the world's axes
DenseGrid read_dense_grid(const std::filesystem::path& file);

/// Sets `lit`.
void find_lit_blocks(DenseGrid& grid);

}  // namespace pileus::bench
