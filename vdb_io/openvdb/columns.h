#pragma once

#include <array>
#include <optional>
#include <vector>

#include <openvdb/openvdb.h>

#include "lib/math/affine.h"

namespace pileus {

/// Columns of a density: integrals of rho along every axis-parallel line of voxels [m]. With extinction
/// sigma_t they are optical depths after multiplication with it.
struct Columns {
  /// Per index axis: the non-empty columns, sorted.
  std::array<std::vector<double>, 3> sorted;

  double max() const;
  /// The column that `fraction` of the non-empty ones do not exceed, averaged over the axes.
  double quantile(double fraction) const;
};

/// Non-finite and negative values count as 0.
///   returns: nothing where a face of the active bounds has more than 2^24 voxels: too many lines to hold
std::optional<Columns> integrate_columns(const openvdb::FloatGrid& grid, const Affine& world_from_index);

}  // namespace pileus
