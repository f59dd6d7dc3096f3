#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "lib/volume/voxel_source.h"

namespace pileus {

// The loops over all voxels of a grid. One source serves every instruction set (Highway).

/// The largest value of some leaves; reached[i] as in VoxelSource.
float scan_leaves(std::span<const VoxelLeaf> leaves, uint8_t* reached);

/// What one look at a leaf tells.
struct LeafLook {
  bool is_plain;    ///< no value has a sign, none is infinite or NaN; else only `reached` and `largest` hold
  uint8_t reached;  ///< as in VoxelSource, where no value is negative or NaN
  float largest;    ///< of all values, or 0
  float lowest_active;   ///< infinity where none is active
  float highest_active;  ///< -infinity where none is active
  uint32_t inactive_nonzero;
};

/// Looks at 8^3 voxels; `active` is their mask, 8 words.
LeafLook look_at_leaf(const float* values, const uint64_t* active);

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
///   means: kMeansPitch, see QuantizedValues::means
QuantizedBrick quantize_brick(const BrickSource& source, double scale, int16_t* values, int16_t* means);

inline constexpr int kQuantizedPitch = 736, kMeansPitch = 64;

}  // namespace pileus
