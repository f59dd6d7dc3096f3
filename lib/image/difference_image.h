#pragma once

#include <string_view>

#include "lib/image/image.h"

namespace pileus {

/// The error that has the full colour where nothing else is asked for: ten times the default tolerance.
inline constexpr double kDefaultDifferenceScale = 0.02;

/// A picture of test - reference: white where they are equal, through to full red at +scale and beyond, full
/// blue at -scale and beyond, in equal steps of display values. Of several channels, a pixel shows the one
/// with the largest absolute difference. The scale is fixed, so that pictures with the same scale compare.
/// Pixels that cannot be compared are NaN, which the PNG writer paints magenta.
/// errors: as channel_pairs; scale [radiance] > 0
Image difference_image(const Image& test, const Image& reference, double scale = kDefaultDifferenceScale,
                       std::string_view channel = {});

}  // namespace pileus
