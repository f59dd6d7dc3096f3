#pragma once

#include <array>
#include <optional>
#include <vector>

#include "lib/math/vec.h"
#include "vdb_io/grid_voxels.h"

namespace pileus {

/// Columns of a density: integrals of rho along every axis-parallel line of voxels [m]. With extinction
/// sigma_t they are optical depths after multiplication with it.
struct Columns {
  /// Per index axis: the non-empty columns, sorted.
  std::array<std::vector<double>, 3> sorted;
  Box3i bounds;  ///< of the voxels above 0, both ends inclusive; empty where there are none

  double max() const;
  /// The column that `fraction` of the non-empty ones do not exceed, averaged over the axes.
  double quantile(double fraction) const;
};

/// The box of all leaves and tiles, both ends inclusive.
Box3i box_of(const GridVoxels& voxels);

/// Non-finite and negative values count as 0.
///   returns: nothing where a face of the box of all leaves and tiles has more than 2^24 voxels
std::optional<Columns> integrate_columns(const GridVoxels& voxels);

}  // namespace pileus
