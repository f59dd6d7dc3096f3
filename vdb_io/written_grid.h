#pragma once

#include <cstdint>
#include <string>

namespace pileus {

/// A grid of a file that has been written.
struct WrittenGrid {
  std::string name;
  std::string name_in_input;  ///< "" where it comes from no file
  std::string value_type;     ///< "float", "vec3s", …
  std::string grid_class;     ///< "fog volume", …; "" where unknown
  uint64_t active_voxels = 0;
  double voxel_size = 0.0;  ///< along x [m]
};

}  // namespace pileus
