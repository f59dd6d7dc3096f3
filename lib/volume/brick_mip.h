#pragma once

#include <optional>

#include "lib/volume/brick_grid.h"

namespace pileus {

/// A grid with voxels of twice the size, and how far its field is from the finer one.
///
/// Node i of the coarse grid lies at node 2i of the fine one. Both fields are trilinear on every cell of the
/// fine grid, and so is their difference: it is largest at a fine node. So `largest_error`, the maximum over
/// the fine nodes, is that over all points. `mean_square_error` is over the fine nodes at which a coarse
/// value or a fine one can be seen.
struct CoarserGrid {
  BrickGrid grid;
  double largest_error = 0.0;
  double mean_square_error = 0.0;
};

/// The next level: along each axis, values are weighted means of three, [1 2 1] / 4. The integral of the
/// field stays, and no value becomes negative. Densities reach up to two fine cells further than before. None
/// where it would save no memory: large boxes of one value cost the fine grid nothing, but this one as much
/// as any.
///
/// Where bricks are dense it takes about an eighth of the fine grid's memory, while building a fifth, and
/// about as long as two passes over the fine values. Uses parallel_for; the result does not depend on
/// threads.
std::optional<CoarserGrid> coarsen(const BrickGrid& fine);

}  // namespace pileus
