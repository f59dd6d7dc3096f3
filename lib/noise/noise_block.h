#pragma once

#include <cstddef>

#include "lib/math/vec.h"

namespace pileus {

/// A regular block of points: origin + spacing * (i, j, k) with 0 <= i < count.x and so on. Arrays over a
/// block are values[count.x][count.y][count.z], z fastest, as in a VDB leaf. A row is a block with counts of
/// 1 along two axes.
struct NoiseBlock {
  Vec3d origin;          ///< [m]
  double spacing = 1;    ///< [m], > 0
  Vec3i count{8, 8, 8};  ///< each >= 1

  size_t size() const { return size_t(count.x) * size_t(count.y) * size_t(count.z); }
};

}  // namespace pileus
