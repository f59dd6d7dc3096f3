#pragma once

#include <filesystem>
#include <vector>

namespace pileus::bench {

/// Writes a NumPy array of 32-bit floats, the last index fastest: pixels[height][width] row by row from the
/// top, or rho[nz][ny][nx]. errors: Error(file) where it cannot be written
void write_npy(const std::filesystem::path& file, const std::vector<float>& values,
               const std::vector<int>& shape);

}  // namespace pileus::bench
