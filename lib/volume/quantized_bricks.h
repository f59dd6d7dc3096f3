#pragma once

#include <cstdint>

#include "lib/core/large_array.h"
#include "lib/volume/brick_pyramid.h"
#include "lib/volume/kernels/leaf_kernels.h"
#include "lib/volume/voxel_source.h"

namespace pileus {

/// Values of bricks in 16 bits: value = scale * (stored + kZero), nearest to the voxel's; 0 stays 0. Bricks
/// are laid out as those of a BrickGrid, at half the bytes: 1472 a brick.
///
/// Beside them lies the field at half the resolution, for whoever looks at all of it but not closely: mean k
/// is that of the 2^3 values 2k and 2k + 1, and stands in their middle. A brick has 4^3 of them, 128 bytes;
/// what ends its rows is the next brick's.
struct QuantizedValues {
  static constexpr int kZero = 32768;
  static constexpr int kPitch = kQuantizedPitch;
  static constexpr int kMeansPitch = pileus::kMeansPitch;

  LargeArray<int16_t> stored;
  LargeArray<int16_t> means;  ///< stored as values are, [brick][x][y][z]: brick n's begin at n * kMeansPitch
  size_t count = 0;
  double scale = 1.0;  ///< has 8 significant bits, so that each value is a float

  // What rounding does to the field: at most, and as far as neighbouring voxels err alike.
  double max_error = 0.0;   ///< of any value
  double mean_error = 0.0;  ///< |mean error of a brick's voxels|, averaged over bricks that hold something
  double mean_value = 0.0;  ///< of the voxels of those bricks
};

/// Distance between neighbouring 16-bit values of which the last is >= max; 0 where there is none, because
/// max is among the smallest or largest floats.
double quantization_scale(float max);

/// Voxels in 16-bit bricks under a pyramid of the ranges of these, in one pass over the voxels. Uses
/// parallel_for; the result does not depend on threads or on the order of the sources.
/// Needs quantization_scale(voxels.max_value()) > 0.
/// errors: those of BrickPyramid; Error(failed) where the bricks need more than half of the machine's memory
BrickPyramid build_quantized_bricks(const VoxelSource& voxels);

}  // namespace pileus
