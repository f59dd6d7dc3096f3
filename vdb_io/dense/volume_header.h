#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "lib/math/affine.h"
#include "lib/math/vec.h"

namespace pileus {

/// What a dense file says about its samples beyond their values. It stands as JSON in a file of its own,
/// beside the data: cloud.df3 has cloud.df3.json. Without one a .df3 or .npy file means the default.
struct VolumeHeader {
  std::string grid = "density";           ///< the grid's name
  std::string grid_class = "fog volume";  ///< or "level set", "staggered", "unknown"
  double background = 0.0;                ///< value outside the box, for every channel
  Vec3i first_voxel{0, 0, 0};             ///< index of the voxel of the first sample
  Affine world_from_index;                ///< of voxel centres [m]
  std::optional<double> value_scale;      ///< .df3: the value of the largest whole number

  // How a .raw file stores its samples; .df3 and .npy files say so themselves, and must agree.
  std::string type = "float32";
  bool big_endian = false;
  bool z_fastest = false;
  std::optional<Vec3i> size;
  int channels = 1;
  std::optional<uint32_t> crc32;  ///< of the whole data file, where known
};

/// cloud.df3.json for cloud.df3.
std::filesystem::path header_path(const std::filesystem::path& data);

/// The header beside a data file; none where there is no such file.
/// errors: Error(file) for the header's own name, with the byte where JSON ends to be JSON, or the key that
///         is missing, unknown or not of its type
std::optional<VolumeHeader> read_volume_header(const std::filesystem::path& data);

/// Throws Error(file) where the header gives a size or, if asked to look, a checksum that is not the data
/// file's.
void check_header_fits(const std::filesystem::path& data, const VolumeHeader& header, const Vec3i& size,
                       int channels, bool with_checksum);

/// The header as JSON text. `pov_pattern`: how POV-Ray would place the samples; "" leaves that out.
std::string header_text(const std::filesystem::path& data, const VolumeHeader& header,
                        const std::string& pov_pattern = "");

/// CRC-32 of a file, as zlib counts it. Throws Error(file) where it cannot be read.
uint32_t crc32_of_file(const std::filesystem::path& path);

}  // namespace pileus
