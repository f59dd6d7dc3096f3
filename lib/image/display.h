#pragma once

#include <array>
#include <cstdint>
#include <filesystem>

#include "lib/image/image.h"

namespace pileus {

enum class DisplayCurve { srgb, gamma };

/// Beyond this, up or down, an exposure is refused by whoever reads it.
inline constexpr double kMaxExposureStops = 100.0;

/// How linear radiance L becomes a display value v in [0, 1]:
///   x = clamp(L * 2^exposure_stops, 0, 1)
///   v = the sRGB curve of x (IEC 61966-2-1), or x^(1 / gamma)
struct DisplayTransform {
  double exposure_stops = 0.0;
  DisplayCurve curve = DisplayCurve::srgb;
  double gamma = 2.2;  ///< used by DisplayCurve::gamma alone; above 0
};

/// The sRGB curve and its inverse, continued linearly below 0.
double srgb_from_linear(double linear);
double linear_from_srgb(double encoded);

/// The display value of one channel's radiance. NaN stays NaN.
double display_value(const DisplayTransform& transform, double radiance);

/// Pixels with a NaN or an infinity in a colour channel.
struct NonFinitePixels {
  size_t count = 0;
  Vec2i first{-1, -1};  ///< the first of them in reading order, from the top left
};

/// The channels that make the colour of a picture: R, G and B, or Y three times.
/// errors: Error(usage) where the image has neither
std::array<const Channel*, 3> colour_channels(const Image& image);

/// 8-bit display values.
struct DisplayImage {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgb;  ///< rgb[height][width][3]
  NonFinitePixels non_finite;
};

/// The picture as a screen shows it, rounded to the nearest of 256 steps. Pixels that are not finite become a
/// loud magenta and are counted. Alpha is left out: the colours of a render already contain their background.
DisplayImage to_display(const Image& image, const DisplayTransform& transform);

/// Writes to_display(image) as an opaque 8-bit PNG file that names its curve.
/// errors: Error(file) where the file cannot be written; then nothing is left under its name. Error(failed)
///         where libpileus_pictures cannot be loaded
NonFinitePixels write_png(const std::filesystem::path& file, const Image& image,
                          const DisplayTransform& transform = {});

}  // namespace pileus
