#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "lib/core/large_array.h"

namespace pileus {

/// A plane of numbers that are no colours, such as heights: values[y * width + x], as the file has them.
struct NumberPlane {
  int width = 0;
  int height = 0;
  std::vector<float, LargeAllocator<float>> values;
};

/// Refuses a plane that a file claims to have and that cannot be held: ask before allocating. errors:
/// Error(file)
void check_plane_size(const std::filesystem::path& file, int64_t width, int64_t height, uint64_t channels);

/// Reads the one channel of a picture, or the grey one beside its alpha: whole numbers are not scaled, and no
/// curve is undone. errors: Error(file) where the file is missing, damaged, no picture, has colours or is
/// implausibly large; Error(failed) where libpileus_pictures cannot be loaded
NumberPlane read_number_plane(const std::filesystem::path& file);

}  // namespace pileus
