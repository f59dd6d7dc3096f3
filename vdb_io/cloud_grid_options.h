#pragma once

#include <cstdint>
#include <functional>

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

}  // namespace pileus
