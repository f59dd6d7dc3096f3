#pragma once

#include <filesystem>
#include <vector>

#include "lib/math/vec.h"

namespace pileus::bench {

/// Writes one plane of pixels, row by row from the top, as a NumPy array pixels[height][width] of 32-bit
/// floats. errors: Error(file) where it cannot be written
void write_npy(const std::filesystem::path& file, const std::vector<float>& pixels, const Vec2i& size);

}  // namespace pileus::bench
