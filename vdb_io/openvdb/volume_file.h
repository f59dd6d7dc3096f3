#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "vdb_io/vdb_directory.h"
#include "vdb_io/volume_format.h"

namespace pileus {

/// The directory of a volume file of any format: grids with name, type and class; nothing of their voxels has
/// been read. Names are unique: density[1] where they repeat.
/// errors: Error(file), as the format's reader; Error(usage) for an unknown extension
VdbDirectory read_volume_directory(const std::filesystem::path& path);

/// One grid of a file, of the type it has there, with its metadata.
///   entry: of read_volume_directory(path)
/// errors: Error(file) for damaged files, for types and transforms that pileus does not know
openvdb::GridBase::Ptr read_volume_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                        const VdbGridEntry& entry);

/// The file's own metadata, as OpenVDB holds it; empty for other formats than .vdb.
openvdb::MetaMap read_volume_metadata(const std::filesystem::path& path);

}  // namespace pileus
