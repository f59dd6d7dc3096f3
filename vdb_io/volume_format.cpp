#include "vdb_io/volume_format.h"

#include <algorithm>
#include <cctype>
#include <map>

namespace pileus {

std::optional<VolumeFormat> volume_format(const std::filesystem::path& path) {
  static const std::map<std::string, VolumeFormat> kFormats{{".vdb", VolumeFormat::vdb},
                                                            {".nvdb", VolumeFormat::nvdb},
                                                            {".df3", VolumeFormat::df3},
                                                            {".npy", VolumeFormat::npy},
                                                            {".raw", VolumeFormat::raw}};
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  const auto found = kFormats.find(extension);
  return found == kFormats.end() ? std::nullopt : std::optional(found->second);
}

std::string volume_extensions() {
  return ".vdb, .nvdb, .df3, .npy or .raw";
}

}  // namespace pileus
