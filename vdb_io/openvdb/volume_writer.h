#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "vdb_io/write_options.h"

namespace pileus {

/// Writes grids as they are: type, values, class, transform, and as much metadata as the format can hold.
/// returns: what a reader of the file should know, a sentence each
/// errors: Error(file) where the format cannot hold a grid; Error(usage) for an unknown extension, or a codec
///         or precision that the format does not have
std::vector<std::string> write_volume(const std::filesystem::path& path,
                                      const std::vector<openvdb::GridBase::Ptr>& grids,
                                      const openvdb::MetaMap& metadata, const VolumeWriteOptions& options);

}  // namespace pileus
