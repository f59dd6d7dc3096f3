#pragma once

#include <openvdb/openvdb.h>

#include "vdb_io/grid_voxels.h"

namespace pileus {

/// The voxels of a grid where they are: leaves of zeros among them, counts and owner left to the caller.
/// errors: Error(file) where the transform is singular
GridVoxels voxels_of(openvdb::FloatGrid& grid);

}  // namespace pileus
