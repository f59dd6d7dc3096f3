#pragma once

#include <memory>

#include <nanovdb/util/GridHandle.h>

#include "lib/math/affine.h"
#include "lib/volume/density_field.h"

namespace pileus {

/// A trilinear field on a sparse grid, read straight from a NanoVDB float grid.
///   grid: densities >= 0 and finite, background 0; voxel values sit at integer index positions. For every cell
///         [i, i+1]^3 with a non-zero corner, voxel i must lie in a leaf or in an active tile: the walk over cells finds
///         work by that node alone (vdb_io dilates the topology so that this holds).
///   world_from_index: any invertible affine map, in double (the map inside the grid is ignored)
std::shared_ptr<const DensityField> make_grid_field(nanovdb::GridHandle<nanovdb::HostBuffer> grid,
                                                    const Affine& world_from_index);

}  // namespace pileus
