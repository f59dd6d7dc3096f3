#pragma once

#include <filesystem>

#include "vdb_io/grid_voxels.h"
#include "vdb_io/vdb_directory.h"

namespace pileus {

/// Reads a scalar grid from a .vdb file without OpenVDB, to the same values: leaf by leaf on all cores, each
/// looked at while it is in the cache. Leaves of zeros are left out. Nothing in the file is trusted, even if
/// it changes meanwhile.
///   entry: of `directory`, which is read_vdb_directory(path); is_scalar()
/// errors: Error(file): those of read_checked_tree and of read_world_from_index; voxels that do not unpack
GridVoxels read_vdb_voxels(const std::filesystem::path& path, const VdbDirectory& directory,
                           const VdbGridEntry& entry);

}  // namespace pileus
