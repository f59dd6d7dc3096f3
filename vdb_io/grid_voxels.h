#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "lib/math/affine.h"
#include "lib/volume/voxel_source.h"
#include "vdb_io/value_counts.h"

namespace pileus {

/// The voxels of a scalar grid as floats, from whatever file and by whatever library they were read.
struct GridVoxels {
  struct Leaf {
    Vec3i origin;   ///< a multiple of 8
    float* values;  ///< as in VoxelLeaf
  };

  std::vector<Leaf> leaves;      ///< at least those that hold something else than 0
  std::vector<VoxelTile> tiles;  ///< those that are not 0, active or not
  float background = 0.0f;
  uint64_t active_voxels = 0;
  ValueCounts counts;
  LeafScan scan;  ///< empty where nobody has made it, or where it does not hold any more
  Affine world_from_index;
  std::shared_ptr<void> owner;  ///< keeps the values alive
};

}  // namespace pileus
