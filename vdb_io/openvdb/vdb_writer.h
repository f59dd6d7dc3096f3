#pragma once

#include <filesystem>
#include <span>
#include <string>

#include <openvdb/openvdb.h>

#include "vdb_io/write_options.h"
#include "vdb_io/written_grid.h"

namespace pileus {

/// Writes fog volumes to a `.vdb` file as other programs expect them: class fog volume, background 0,
/// statistics in each grid's metadata. The grids are not modified. The file appears under its name only when
/// it is whole; the same grids and options give the same bytes (OpenVDB's random file id is replaced by one
/// made of the content).
///   grids: not null, named, no two alike, finite values, background 0
/// errors: Error(file) where a grid is not so, where a value is too large for half, or where the file cannot
/// be
///         written
void write_vdb(const std::filesystem::path& path, std::span<const openvdb::FloatGrid::ConstPtr> grids,
               const VdbWriteOptions& options = {});

/// Writes grids of any type as they are: class, values, states, transform and metadata; statistics are
/// renewed. `metadata` becomes the file's; "creator" is left as it says.
///   grids: not null, named, no two alike
/// errors: Error(file) where a grid is not so, where a value is too large for half, or where the file cannot
///         be written
void write_vdb_grids(const std::filesystem::path& path, std::span<const openvdb::GridBase::ConstPtr> grids,
                     const openvdb::MetaMap& metadata, const VdbWriteOptions& options = {});

/// What is told of a grid in a file that has been written.
WrittenGrid written_grid(const openvdb::GridBase& grid);

}  // namespace pileus
