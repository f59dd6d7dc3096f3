#pragma once

#include <optional>
#include <string>

namespace pileus {

/// OpenVDB zips neither fog volumes nor level sets: those stay unpacked where zip is asked for.
enum class VdbCodec { none, blosc, zip };

struct VdbWriteOptions {
  bool half = false;  ///< store values as 16-bit floats; write_vdb_grids: also where false, grids
                      ///< that say so themselves
  VdbCodec codec = VdbCodec::blosc;  ///< for the active voxels; inactive ones are left out either way
  std::string creator{};             ///< file metadata "creator"; "": "pileus VERSION"
};

/// The same for a volume file of any format.
struct VolumeWriteOptions {
  bool half = false;            ///< 16-bit floats: .vdb, .npy, .raw
  std::string codec;            ///< "none", "zip" or "blosc"; "": what suits the format
  std::optional<int> df3_bits;  ///< 8, 16 or 32, 16 by default; of .df3 files only
};

}  // namespace pileus
