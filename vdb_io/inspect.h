#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lib/math/vec.h"
#include "vdb_io/finding.h"
#include "vdb_io/vdb_directory.h"
#include "vdb_io/vdb_structure.h"

namespace pileus {

/// What voxel values of a scalar grid look like.
struct ValueReport {
  double background = 0.0;
  double min = 0.0, max = 0.0;  ///< over finite active values
  uint64_t nan = 0, infinite = 0, negative = 0, inactive_nonzero = 0;
  size_t memory_bytes = 0;  ///< as OpenVDB holds the grid
  std::optional<double>
      max_column;  ///< longest axis-parallel integral of rho [m]: optical depth at extinction 1
};

/// What the vectors of a vector grid look like.
struct VectorReport {
  double max_length = 0.0;         ///< over finite active values
  uint64_t nan = 0, infinite = 0;  ///< vectors with such a component, active or not
  size_t memory_bytes = 0;
};

struct GridReport {
  VdbGridEntry entry;
  std::optional<Vec3d> voxel_size;         ///< edges [m]; absent for frustums
  std::optional<GridStructure> structure;  ///< absent for trees that are not walked (points, shared trees, …)
  std::optional<ValueReport> values;       ///< scalar grids only
  std::optional<VectorReport> vectors;     ///< grids of float or double vectors only
  std::string problem;                     ///< why the grid cannot be read at all; "" where it can
};

/// Everything `pileus info` says about a volume file.
struct VdbReport {
  VdbDirectory directory;
  std::string default_grid;       ///< what a scene without `grid` shows; "" where it must say
  std::vector<GridReport> grids;  ///< all, or the one asked for
  std::vector<Finding> findings;  ///< the file's own first, then grid by grid
};

/// Reads every grid of the file, one after the other, or only the one named.
/// errors: Error(file) where the file as a whole cannot be read or has no such grid; a grid that cannot be
/// read
///         has its `problem`
VdbReport inspect_vdb(const std::filesystem::path& path, const std::string& grid = "");

}  // namespace pileus
