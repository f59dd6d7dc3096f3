#include "lib/image/metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "lib/core/error.h"
#include "lib/image/channel_pairs.h"
#include "lib/image/display.h"
#include "lib/image/ssim.h"

namespace pileus {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// 1 for each pixel that can be compared in every channel.
using PixelMask = std::vector<char>;

PixelMask comparable_pixels(const std::vector<ChannelPair>& pairs, size_t pixel_count) {
  PixelMask mask(pixel_count, 1);
  for (const ChannelPair& pair : pairs) {
    for (size_t i = 0; i < pixel_count; ++i) {
      if (!is_comparable((*pair.test)[i], (*pair.reference)[i])) mask[i] = 0;
    }
  }
  return mask;
}

// ---- linear values ----

struct ErrorSums {
  double square = 0.0, absolute = 0.0, signed_sum = 0.0, relative_square = 0.0, max_absolute = 0.0;

  void add(double x_minus_r, double r) {
    const double squared = x_minus_r * x_minus_r;
    square += squared;
    absolute += std::abs(x_minus_r);
    signed_sum += x_minus_r;
    relative_square += squared / (r * r + 1e-2);
    max_absolute = std::max(max_absolute, std::abs(x_minus_r));
  }
};

/// The smallest value that at least `fraction` of the values do not exceed. Reorders them.
double quantile(std::vector<double>& values, double fraction) {
  const auto rank = size_t(std::ceil(fraction * double(values.size())));
  const auto nth = values.begin() + std::ptrdiff_t(std::clamp(rank, size_t(1), values.size()) - 1);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

void measure_linear(const std::vector<ChannelPair>& pairs, const PixelMask& mask, ImageDifference& result) {
  ErrorSums sums;
  std::vector<double> absolutes;
  absolutes.reserve(mask.size() * pairs.size());
  for (const ChannelPair& pair : pairs) {
    for (size_t i = 0; i < mask.size(); ++i) {
      if (!mask[i]) continue;
      const double difference = signed_difference((*pair.test)[i], (*pair.reference)[i]);
      sums.add(difference, (*pair.reference)[i]);
      absolutes.push_back(std::abs(difference));
    }
  }
  const double count = double(absolutes.size());
  result.rmse = std::sqrt(sums.square / count);
  result.mae = sums.absolute / count;
  result.max_abs = sums.max_absolute;
  result.bias = sums.signed_sum / count;
  result.rel_mse = sums.relative_square / count;
  result.quantile_999 = quantile(absolutes, 0.999);
}

// ---- display values ----

/// One side of the pairs as linear display values in [0, 1]: three planes, equal ones where the pairs are
/// one.
RgbPlanes display_linear(const std::vector<ChannelPair>& pairs, const std::vector<float>* ChannelPair::*side,
                         const PixelMask& mask, int width, double exposure) {
  const int height = int(mask.size() / size_t(width));
  RgbPlanes planes{Plane(width, height), Plane(width, height), Plane(width, height)};
  for (size_t c = 0; c < 3; ++c) {
    const std::vector<float>& values = *(pairs[pairs.size() == 3 ? c : 0].*side);
    for (size_t i = 0; i < mask.size(); ++i) {
      planes[c].values[i] = mask[i] ? std::clamp(exposure * double(values[i]), 0.0, 1.0) : 0.0;
    }
  }
  return planes;
}

double psnr(const RgbPlanes& test, const RgbPlanes& reference) {
  double square_sum = 0.0;
  for (size_t c = 0; c < 3; ++c) {
    for (size_t i = 0; i < test[c].values.size(); ++i) {
      const double difference =
          srgb_from_linear(test[c].values[i]) - srgb_from_linear(reference[c].values[i]);
      square_sum += difference * difference;
    }
  }
  return -10.0 * std::log10(square_sum / (3.0 * double(test[0].values.size())));
}

/// The sRGB curve of the luminance (Rec. 709 weights).
Plane display_luminance(const RgbPlanes& rgb) {
  Plane result(rgb[0].width, rgb[0].height);
  for (size_t i = 0; i < result.values.size(); ++i) {
    result.values[i] =
        srgb_from_linear(0.2126 * rgb[0].values[i] + 0.7152 * rgb[1].values[i] + 0.0722 * rgb[2].values[i]);
  }
  return result;
}

void measure_display(const std::vector<ChannelPair>& pairs, const PixelMask& mask, int width,
                     const CompareOptions& options, ImageDifference& result) {
  const double exposure = std::exp2(options.exposure_stops);
  RgbPlanes test = display_linear(pairs, &ChannelPair::test, mask, width, exposure);
  RgbPlanes reference = display_linear(pairs, &ChannelPair::reference, mask, width, exposure);
  result.psnr = psnr(test, reference);
  result.ssim = ssim(display_luminance(test), display_luminance(reference));
  result.flip = mean(flip_map(std::move(test), std::move(reference), options.pixels_per_degree));
}

}  // namespace

ImageDifference compare_images(const Image& test, const Image& reference, const CompareOptions& options) {
  PILEUS_CHECK(std::abs(options.exposure_stops) <= kMaxExposureStops && options.pixels_per_degree >= 1.0);
  const std::vector<ChannelPair> pairs = channel_pairs(test, reference, options.channel);
  const PixelMask mask = comparable_pixels(pairs, test.pixel_count());

  ImageDifference result;
  for (const ChannelPair& pair : pairs) result.channels.push_back(pair.name);
  result.nan_pixels = size_t(std::count(mask.begin(), mask.end(), 0));
  if (result.nan_pixels == mask.size()) {
    result.rmse = result.mae = result.max_abs = result.bias = result.rel_mse = result.quantile_999 = kNaN;
    result.psnr = result.ssim = result.flip = kNaN;
    return result;
  }
  measure_linear(pairs, mask, result);
  measure_display(pairs, mask, test.width, options, result);
  return result;
}

std::span<const Metric> all_metrics() {
  using D = ImageDifference;
  static constexpr std::array<Metric, 10> kMetrics{{
      {"rmse", "radiance", "root of the mean square error", [](const D& d) { return d.rmse; }},
      {"mae", "radiance", "mean absolute error", [](const D& d) { return d.mae; }},
      {"max", "radiance", "largest absolute error", [](const D& d) { return d.max_abs; }},
      {"bias", "radiance", "mean signed error, first minus second", [](const D& d) { return d.bias; }},
      {"relmse", "", "mean of d^2 / (reference^2 + 0.01)", [](const D& d) { return d.rel_mse; }},
      {"q999", "radiance", "99.9 % of the absolute errors are at most this",
       [](const D& d) { return d.quantile_999; }},
      {"psnr", "dB", "peak signal to noise ratio of the display pictures", [](const D& d) { return d.psnr; }},
      {"ssim", "", "structural similarity of the display pictures; 1 is alike",
       [](const D& d) { return d.ssim; }},
      {"flip", "", "difference seen when the display pictures alternate; 0 is alike",
       [](const D& d) { return d.flip; }},
      {"nan_pixels", "pixels", "not comparable (NaN or infinite), left out of the rest",
       [](const D& d) { return double(d.nan_pixels); }},
  }};
  return kMetrics;
}

}  // namespace pileus
