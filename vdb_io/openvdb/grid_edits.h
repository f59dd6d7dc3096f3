#pragma once

#include <filesystem>
#include <string>

#include <openvdb/openvdb.h>

#include "lib/math/vec.h"

namespace pileus {

// Changes of one grid in place, of any type that pileus knows (grid_types.h). `path` names the file in
// errors.

/// Sets everything outside a world-space box to the background: a voxel stays where its centre is in the box.
/// errors: Error(file) where the grid's axes are not the world's
void crop_grid(const std::filesystem::path& path, openvdb::GridBase& grid, const Box3d& box);

/// Places the grid `factor` times as large, and as far from the world's origin. The distances of a level set
/// grow with it, other values stay.
/// errors: Error(file) where voxels would get too small or too wide for a transform to be inverted, or
///         distances too large for their type
void scale_grid(const std::filesystem::path& path, openvdb::GridBase& grid, double factor);

/// The edits below are for numbers and vectors, whose components count alone; they see the values of active
/// and inactive voxels and the background, and throw Error(file) for grids of truth values, and where the
/// grid's type cannot hold a result.
/// Replaces NaN and infinite values.
/// returns: how many voxels were changed; a tile counts with all of its own
uint64_t replace_nan(const std::filesystem::path& path, openvdb::GridBase& grid, double value);
/// Replaces active values below `lowest`; the number changed. NaN stays. Inactive values and the background
/// are raised to 0 at most, lest density appear where there was none.
uint64_t raise_to(const std::filesystem::path& path, openvdb::GridBase& grid, double lowest);
void multiply_values(const std::filesystem::path& path, openvdb::GridBase& grid, double factor);
/// Inactive voxels that held the old background hold the new one.
void change_background(const std::filesystem::path& path, openvdb::GridBase& grid, double value);

}  // namespace pileus
