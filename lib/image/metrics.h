#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lib/image/flip.h"
#include "lib/image/image.h"

namespace pileus {

struct CompareOptions {
  std::string channel;          ///< compare this one alone; "": the common colours (R, G and B, or Y)
  double exposure_stops = 0.0;  ///< for the metrics of the display picture: psnr, ssim and flip
  double pixels_per_degree = kDefaultPixelsPerDegree;  ///< for flip; at least 1
};

/// How far a test picture x lies from a reference r of equal size.
///
/// The first group is over the linear values d = x - r of all compared channels; a pixel counts in nan_pixels
/// instead where a channel of either picture is NaN, or an infinity that the other does not share. The
/// second group is over display pictures, sRGB values of clamp(2^exposure * radiance, 0, 1), not rounded to 8
/// bits; there those pixels are black in both, which hides them: look at nan_pixels first. All are NaN where
/// no pixel is left to compare. Equal for any number of threads.
struct ImageDifference {
  std::vector<std::string> channels;  ///< what was compared

  double rmse = 0.0;          ///< sqrt(mean(d^2))
  double mae = 0.0;           ///< mean(|d|)
  double max_abs = 0.0;       ///< max(|d|)
  double bias = 0.0;          ///< mean(d)
  double rel_mse = 0.0;       ///< mean(d^2 / (r^2 + 0.01))
  double quantile_999 = 0.0;  ///< the smallest value that at least 99.9 % of the |d| do not exceed

  double psnr = 0.0;  ///< -20 log10(rmse of the display values) [dB]; +inf where they are equal
  double ssim = 0.0;  ///< structural similarity of the display luminance; 1 where alike
  double flip = 0.0;  ///< the mean of flip_map; 0 where alike, at most 1

  size_t nan_pixels = 0;
};

/// errors: as channel_pairs
ImageDifference compare_images(const Image& test, const Image& reference, const CompareOptions& options = {});

/// A metric under the name by which the command line and reports know it.
struct Metric {
  std::string_view name;
  std::string_view unit;  ///< "radiance" is that of the pictures; "" has none
  std::string_view help;
  double (*value)(const ImageDifference&);
};

/// All of them, in the order of listings.
std::span<const Metric> all_metrics();

}  // namespace pileus
