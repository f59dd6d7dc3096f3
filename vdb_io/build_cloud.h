#pragma once

#include <cstdint>
#include <functional>

#include <openvdb/openvdb.h>

#include "lib/cloud/procedural_cloud.h"

namespace pileus {

struct CloudGridOptions {
  double voxel_size = 0.0;                 ///< edge of a voxel [m], > 0
  int64_t max_voxels = int64_t(1) << 29;   ///< allowed in the cloud's bounding box; 4 bytes each at worst
  std::function<bool(double)> progress{};  ///< gets the share that is done, rising to 1; false cancels
};

/// Samples a cloud into a sparse fog volume "density" with background 0. Voxel (i, j, k) holds the density at
/// world point voxel_size * (i, j, k), rounded to float; voxels of density 0 are inactive. Uses parallel_for;
/// the grid is the same bit for bit whatever the number of threads. `progress` is called from one thread at a
/// time. errors: Error(usage) where voxel_size is not positive, or so small that the grid would exceed
/// max_voxels (the
///         message names a size that fits) or the range of voxel indices; or so large that no voxel lies in
///         the cloud's bounds. All are found before memory is asked for. Error(cancelled) where progress says
///         so.
openvdb::FloatGrid::Ptr build_cloud(const ProceduralCloud& cloud, const CloudGridOptions& options);

}  // namespace pileus
