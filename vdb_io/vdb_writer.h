#pragma once

#include <filesystem>
#include <span>
#include <string>

#include <openvdb/openvdb.h>

namespace pileus {

enum class VdbCodec { none, zip, blosc };

struct VdbWriteOptions {
  bool half = false;                  ///< store values as 16-bit floats
  VdbCodec codec = VdbCodec::blosc;   ///< on top of leaving out inactive voxels
  std::string creator;                ///< file metadata "creator"; "": "pileus VERSION"
};

/// Writes fog volumes to a `.vdb` file as other programs expect them: class fog volume, background 0, statistics in
/// each grid's metadata. The grids are not modified. The file appears under its name only when it is whole, and the
/// same grids give the same bytes: OpenVDB's random file id is replaced by one made of the content.
///   grids: names unique and not empty, background 0
/// errors: Error(file) where the file cannot be written or a grid is none of the above; values too large for half
void write_vdb(const std::filesystem::path& path, std::span<const openvdb::FloatGrid::ConstPtr> grids,
               const VdbWriteOptions& options = {});

}  // namespace pileus
