#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "lib/volume/voxel_source.h"

namespace pileus {

// The loops over all voxels of a grid. One source serves every instruction set (Highway).

/// The largest value of some leaves; reached[i] as in VoxelSource.
float scan_leaves(std::span<const VoxelLeaf> leaves, uint8_t* reached);

/// Where the 9^3 corner values of a brick come from: of its own leaf and of its upper neighbours'.
struct BrickSource {
  std::array<const float*, 8> leaves{};   ///< [dx + 2 dy + 4 dz]; null: uniform
  std::array<float, 8> uniform_values{};  ///< where there is no leaf
};

/// What a brick of 16-bit values came out as.
struct QuantizedBrick {
  int16_t lo, hi;      ///< over its 9^3 values
  double sum, errors;  ///< over the voxels of its own leaf: of the values; of value - quantised value
};

/// Quantises a brick: round(value / scale) - 32768, [x][y][z] with strides 81, 9, 1.
///   values: kQuantizedPitch of them, aligned to 64 bytes
QuantizedBrick quantize_brick(const BrickSource& source, double scale, int16_t* values);

inline constexpr int kQuantizedPitch = 736;

}  // namespace pileus
