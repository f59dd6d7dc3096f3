#pragma once

#include <filesystem>

#include "lib/image/image.h"

namespace pileus {

/// Lossless ways to pack an EXR file: `zip` packs 16 scanlines at a time, `zip_line` one.
enum class ExrCompression { none, rle, zip_line, zip, piz };

struct ExrOptions {
  /// Store colour channels (R, G, B, A and Y, also of layers such as "sun.R") as 16-bit floats. All others
  /// stay 32-bit: a rounded depth or sample count is wrong, and a rounded error bound bounds nothing. So
  /// does a colour channel with a value beyond the range of a half (65504).
  bool half_colours = false;
  ExrCompression compression = ExrCompression::zip;
};

/// Writes `image` as a scanline EXR file with every channel under its name. Equal images give equal bytes.
/// Metadata become attributes typed string, double, int or m44d, named with the prefix "pileus:"; the
/// matrices worldToCamera and worldToNDC keep their conventional name and type (m44f, so they round).
/// errors: Error(file) where the file cannot be written; then nothing is left under its name
void write_exr(const std::filesystem::path& file, const Image& image, const ExrOptions& options = {});

/// Reads the (first) flat picture of an EXR file, tiled or scanline. Values of 32-bit float channels are
/// those of the file, bit for bit; halves convert exactly, unsigned integers to the nearest float. The
/// picture is the display window: 0 where the file has no data, without the data outside. The metadata are
/// those that write_exr writes; other attributes are not read. errors: Error(file) where the file is missing,
/// damaged, deep, subsampled, or implausibly large
Image read_exr(const std::filesystem::path& file);

}  // namespace pileus
