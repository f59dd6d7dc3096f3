#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "vdb_io/grid_choice.h"
#include "vdb_io/openvdb/grid_values.h"
#include "vdb_io/read_options.h"
#include "vdb_io/vdb_directory.h"

namespace pileus {

struct DensityGrid {
  openvdb::FloatGrid::Ptr grid;  ///< fog volume: values finite and >= 0, background 0, affine transform
  VdbGridEntry source;           ///< what the file says about it
  ValueCounts values;  ///< as found in the file (before bad values became 0, after a level set became fog)
  std::vector<std::string> notes;  ///< what was chosen or converted on the way, a sentence each
};

/// Reads one density grid; other grids of the file are not touched. Every scalar type becomes float
/// (true is 1). Inactive voxels keep their values: interpolation reads them as it reads active ones.
/// errors: Error(file) for damaged files, grids that are no density, frustum or singular transforms, empty
///         grids, bad values under BadValuePolicy::refuse, a background that is not 0
DensityGrid read_density_grid(const std::filesystem::path& path, const VdbReadOptions& options = {});

/// Any grid of numbers or vectors that check_grid_structure knows, as the file has it.
/// errors: Error(file) for damaged files, other types, frustum transforms, trees larger than memory_budget()
openvdb::GridBase::Ptr read_vdb_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                     const VdbGridEntry& entry);

/// The metadata of a .vdb file as a whole. Throws Error(file).
openvdb::MetaMap read_vdb_metadata(const std::filesystem::path& path);

/// The same grid where it is one of floats, a copy where it is one of other numbers; null for others.
openvdb::FloatGrid::Ptr as_float(const openvdb::GridBase::Ptr& grid);

/// Replaces the distances of a level set by densities, as FogOfLevelSet has them.
/// returns: what was done, in a sentence
/// errors: Error(file) where distances are not finite, or the background is negative
std::string turn_level_set_into_fog(const std::filesystem::path& path, openvdb::FloatGrid& grid);

/// Any scalar grid of the file as float, otherwise unchanged: what an inspection looks at.
/// errors: Error(file) for damaged files, other types, frustum transforms
openvdb::FloatGrid::Ptr read_scalar_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                         const VdbGridEntry& entry);

/// A grid without its voxels: transform and metadata of whatever type.
openvdb::GridBase::Ptr read_grid_without_voxels(const std::filesystem::path& path, const VdbGridEntry& entry);

}  // namespace pileus
