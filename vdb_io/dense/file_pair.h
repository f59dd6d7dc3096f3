#pragma once

#include <filesystem>
#include <string>

namespace pileus {

struct VolumeHeader;

/// Writes a data file and the header beside it; both appear whole or not at all, and the header's checksum
/// tells them from leftovers of another run. Fills in header.crc32.
/// errors: Error(file)
void write_with_header(const std::filesystem::path& path, const std::string& bytes, VolumeHeader header,
                       const std::string& pov_pattern = "");

}  // namespace pileus
