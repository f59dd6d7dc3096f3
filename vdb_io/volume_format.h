#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace pileus {

/// The formats of volume files, told by their extensions.
enum class VolumeFormat { vdb, nvdb, df3, npy, raw };

/// None where the extension is no volume's.
std::optional<VolumeFormat> volume_format(const std::filesystem::path& path);

/// ".vdb, .nvdb, .df3, .npy or .raw"
std::string volume_extensions();

}  // namespace pileus
