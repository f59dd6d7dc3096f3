#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lib/math/vec.h"

namespace pileus {

/// What a density grid looks like from outside: enough to frame it and to choose an extinction for it.
struct GridSummary {
  std::string grid;          ///< the name of the grid that was read
  Box3d bounds;              ///< world-space box of the voxels above 0, half a voxel around their centres [m]
  Vec3d voxel_size;          ///< edges of a voxel [m]
  double max_density = 0.0;  ///< [1]
  /// 95 % of the non-empty axis-parallel lines integrate to at most this, averaged over the axes [m]; 0 where
  /// the grid is too large for the sum.
  double typical_column = 0.0;
  std::vector<std::string> notes;  ///< what was chosen or converted on the way, a sentence each
};

/// Reads the grid that a `vdb` volume with the same parameters would show; "" chooses as it does. A level set
/// counts as filled with fog, and bad values as 0: a file can be framed before its errors are reported.
/// errors: Error(file), as for reading
GridSummary summarize_density(const std::filesystem::path& path, const std::string& grid);

}  // namespace pileus
