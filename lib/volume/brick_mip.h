#pragma once

#include <optional>

#include "lib/volume/brick_grid.h"

namespace pileus {

/// The next level: voxels of twice the size, node i at node 2i of the fine grid. Along each axis, values are
/// weighted means of three, [1 2 1] / 4: the integral of the field stays, and no value becomes negative.
/// Densities reach up to two fine cells further than before. None where it would save no memory: large boxes
/// of one value cost the fine grid nothing, but this one as much as any.
///
/// Where bricks are dense it takes about an eighth of the fine grid's memory, while building a fifth, and
/// about as long as one pass over the fine values. Uses parallel_for; the result does not depend on threads.
std::optional<BrickGrid> coarsen(const BrickGrid& fine);

/// How far a grid's field is from that of its next level. Both are trilinear on every cell of the fine grid,
/// and so is their difference: it is largest at a fine node. So `largest`, the maximum over the fine nodes,
/// is that over all points.
struct LevelDifference {
  double largest = 0.0;
  double mean_square = 0.0;  ///< over the fine nodes at which one of the fields is not 0
};

/// Costs as much as coarsen(). Uses parallel_for; the result does not depend on threads.
LevelDifference compare_levels(const BrickGrid& fine, const BrickGrid& coarse);

}  // namespace pileus
