#pragma once

#include <cstdint>
#include <filesystem>

namespace pileus {

/// Largest picture that is read: 2^31 pixels.
inline constexpr int64_t kMaxImagePixels = int64_t(1) << 31;

/// Checks the size that the header of an image file claims, before memory is allocated for it. A small file
/// may claim a huge picture: beyond 1 GiB of 32-bit floats, a picture must not be more than 2000 times its
/// file (deflate, the densest common compression, reaches 1032 times). errors: Error(file) where the size is
/// not positive, too large, or not plausible; or the file's length unknown
void check_image_size(const std::filesystem::path& file, int64_t width, int64_t height, int64_t channels);

}  // namespace pileus
