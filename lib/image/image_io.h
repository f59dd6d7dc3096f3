#pragma once

#include <filesystem>

#include "lib/image/display.h"
#include "lib/image/exr_io.h"
#include "lib/image/image.h"

namespace pileus {

/// What stored colours mean.
enum class PictureEncoding {
  by_file,  ///< whole numbers are display values by the curve that the file names, or sRGB; floats are linear
  srgb,     ///< display values of the sRGB curve
  linear,   ///< linear values
};

/// Reads a picture of any format that OpenImageIO knows (EXR, PNG, TIFF, HDR, JPEG, …) as linear values with
/// premultiplied alpha. Files of floats are taken as linear. Files of integers are taken as display values, 1
/// being the largest integer, and linearised by the curve that they name, or else by the sRGB curve; their
/// alpha is linear as it is. So it is `by_file`; else as `encoding` says. Of several pictures in a file, the
/// first is read. The comments are kept.
/// errors: Error(file) where the file is missing, damaged, no picture, a volume, or implausibly large;
///         Error(failed) where it is not EXR and libpileus_pictures cannot be loaded
Image read_image(const std::filesystem::path& file, PictureEncoding encoding = PictureEncoding::by_file);

struct WriteImageOptions {
  ExrOptions exr;            ///< for .exr
  DisplayTransform display;  ///< for .png
};

/// Writes all channels to an .exr file, or the display picture to a .png file.
/// returns: what write_png painted magenta; an .exr file holds every value as it is, so none
/// errors:  as check_image_name, write_exr and write_png
NonFinitePixels write_image(const std::filesystem::path& file, const Image& image,
                            const WriteImageOptions& options = {});

/// Refuses a name that write_image cannot serve: ask before a long render.
/// errors: Error(usage) where the extension is neither .exr nor .png (in upper or lower case); Error(failed)
///         where it is .png and libpileus_pictures cannot be loaded
void check_image_name(const std::filesystem::path& file);

}  // namespace pileus
