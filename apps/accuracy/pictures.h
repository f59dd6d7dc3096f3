#pragma once

#include <string>

#include "lib/image/display.h"
#include "lib/image/image.h"

namespace pileus {

/// A picture as PNG in a `data:` URI, which needs no file beside the page.
std::string data_uri(const Image& image, const DisplayTransform& display);

/// A plane of errors as a picture, on one scale for all: black 1e-6 or less, white 0.1 or more, by the
/// logarithm. Values that are no number are magenta.
Image error_picture(int width, int height, const std::vector<float>& errors);

}  // namespace pileus
