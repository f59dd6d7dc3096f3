#pragma once

#include <openvdb/openvdb.h>

#include "lib/cloud/procedural_cloud.h"
#include "vdb_io/cloud_grid_options.h"

namespace pileus {

/// Samples a cloud into a sparse fog volume "density" with background 0. Voxel (i, j, k) holds the density at
/// world point voxel_size * (i, j, k), in single precision; voxels of density 0 are inactive. Bounds of the
/// density decide cubes of 128^3 to 4^3 voxels before anything is evaluated in them. Uses parallel_for;
/// the grid is the same bit for bit whatever the number of threads. `progress` is called from one thread at a
/// time.
/// errors: Error(usage) where voxel_size is negative, or so small that the grid would exceed max_voxels or
///         the range of voxel indices, or could exceed max_bytes or the memory budget (the message names a
///         size that fits); or so large that no voxel lies in the cloud's bounds. All are found before memory
///         is asked for. Error(cancelled) where progress says so.
openvdb::FloatGrid::Ptr build_cloud(const ProceduralCloud& cloud, const CloudGridOptions& options,
                                    CloudBuildCounters* counters = nullptr);

}  // namespace pileus
