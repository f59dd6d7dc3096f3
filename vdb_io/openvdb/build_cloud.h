#pragma once

#include <cstdint>
#include <functional>

#include <openvdb/openvdb.h>

#include "lib/cloud/procedural_cloud.h"

namespace pileus {

struct CloudGridOptions {
  double voxel_size = 0.0;                 ///< edge of a voxel [m]; 0: as small as the limits allow
  int64_t max_voxels = int64_t(1) << 29;   ///< allowed in the cloud's bounding box
  int64_t max_bytes = 0;                   ///< of the finished grid in memory; 0: no limit
  std::function<bool(double)> progress{};  ///< gets the share that is done, rising to 1; false cancels
};

/// How it was found out what the voxels of the cloud's bounding box hold.
struct CloudBuildCounters {
  int64_t voxels = 0;
  int64_t empty_by_bound = 0;   ///< bounds showed that a whole node holds 0
  int64_t full_by_bound = 0;    ///< bounds showed that a whole node holds 1
  int64_t evaluated = 0;        ///< the free form was evaluated
  int64_t evaluated_empty = 0;  ///< of those, how many hold 0
  int64_t noise_points = 0;     ///< points at which a part of the noise was computed

  /// How many of the empty voxels bounds decided, 0 .. 1; 1 where none is empty.
  double share_of_empty_by_bound() const {
    const int64_t empty = empty_by_bound + evaluated_empty;
    return empty == 0 ? 1.0 : double(empty_by_bound) / double(empty);
  }
};

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
