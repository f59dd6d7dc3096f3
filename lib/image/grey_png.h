#pragma once

#include <filesystem>
#include <optional>

#include "lib/image/read_numbers.h"

namespace pileus {

/// The numbers of a PNG file of grey values of 8 or 16 bits, as they are; nothing for a file that is none, or
/// that has a palette, alpha, fewer bits or interlaced rows: other readers know those. Without OpenImageIO,
/// whose libraries take longer to load than most tables of heights to read, and inflated by ISA-L, which
/// takes half of zlib's time, while another thread undoes the filters. errors: Error(file) where it is
/// damaged or implausibly large
std::optional<NumberPlane> read_grey_png(const std::filesystem::path& file);

}  // namespace pileus
