#include "lib/image/display.h"

#include <algorithm>
#include <cmath>

#include "lib/core/atomic_file.h"
#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/image/load_pictures.h"

namespace pileus {
namespace {

constexpr std::array<uint8_t, 3> kMagenta{255, 0, 255};

/// The radiance at which display step k begins, for k = 1 to 255: where the display value is (k - 0.5) / 255.
/// Comparing with these is many times cheaper than a power for every value.
using StepStarts = std::array<double, 255>;

StepStarts step_starts(const DisplayTransform& transform) {
  PILEUS_CHECK(std::abs(transform.exposure_stops) <= kMaxExposureStops && transform.gamma > 0.0);
  StepStarts starts;
  for (size_t i = 0; i < starts.size(); ++i) {
    const double v = (double(i) + 0.5) / 255.0;
    const double x =
        transform.curve == DisplayCurve::srgb ? linear_from_srgb(v) : std::pow(v, transform.gamma);
    starts[i] = x * std::exp2(-transform.exposure_stops);
  }
  return starts;
}

/// How many steps begin at or below `radiance`: a binary search without branches.
uint8_t display_step(const StepStarts& starts, double radiance) {
  size_t step = 0;
  for (size_t half = 128; half > 0; half /= 2) step += starts[step + half - 1] <= radiance ? half : 0;
  return uint8_t(step);
}

/// Converts row y of the picture; returns its pixels that are not finite.
NonFinitePixels display_row(const std::array<const Channel*, 3>& channels, const StepStarts& starts, int y,
                            DisplayImage& result) {
  NonFinitePixels non_finite;
  for (int x = 0; x < result.width; ++x) {
    const size_t pixel = size_t(y) * size_t(result.width) + size_t(x);
    uint8_t* rgb = result.rgb.data() + 3 * pixel;
    bool finite = true;
    for (size_t c = 0; c < 3; ++c) {
      const float radiance = channels[c]->values[pixel];
      finite = finite && std::isfinite(radiance);
      rgb[c] = display_step(starts, radiance);
    }
    if (finite) continue;
    std::copy(kMagenta.begin(), kMagenta.end(), rgb);
    if (non_finite.count++ == 0) non_finite.first = {x, y};
  }
  return non_finite;
}

}  // namespace

double srgb_from_linear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

double linear_from_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

double display_value(const DisplayTransform& transform, double radiance) {
  const double x = std::clamp(radiance * std::exp2(transform.exposure_stops), 0.0, 1.0);
  return transform.curve == DisplayCurve::srgb ? srgb_from_linear(x) : std::pow(x, 1.0 / transform.gamma);
}

std::array<const Channel*, 3> colour_channels(const Image& image) {
  const std::array<const Channel*, 3> rgb{image.find("R"), image.find("G"), image.find("B")};
  if (rgb[0] && rgb[1] && rgb[2]) return rgb;
  if (const Channel* y = image.find("Y")) return {y, y, y};
  std::vector<std::string> found;
  for (const Channel& channel : image.channels) found.push_back(channel.name);
  throw Error(ErrorKind::usage, SourceLoc{},
              fmt::format("the picture has the channels {}; expected R, G and B, or Y",
                          found.empty() ? "(none)" : fmt::format("{}", fmt::join(found, ", "))));
}

DisplayImage to_display(const Image& image, const DisplayTransform& transform) {
  const auto channels = colour_channels(image);
  DisplayImage result{image.width, image.height, std::vector<uint8_t>(3 * image.pixel_count()), {}};
  const StepStarts starts = step_starts(transform);
  std::vector<NonFinitePixels> rows(size_t(image.height));
  parallel_for(rows.size(), [&](size_t y) { rows[y] = display_row(channels, starts, int(y), result); });
  for (const NonFinitePixels& row : rows) {
    if (result.non_finite.count == 0) result.non_finite.first = row.first;
    result.non_finite.count += row.count;
  }
  return result;
}

NonFinitePixels write_png(const std::filesystem::path& file, const Image& image,
                          const DisplayTransform& transform) {
  const DisplayImage shown = to_display(image, transform);
  const bool is_srgb = transform.curve == DisplayCurve::srgb;
  const PngPicture picture{shown.width,      shown.height,
                           shown.rgb.data(), is_srgb ? StoredCurve::srgb : StoredCurve::gamma,
                           transform.gamma,  comments_of(image)};
  const Pictures& pictures = load_pictures();
  AtomicFile atomic(file);
  std::string reason;
  if (!pictures.write_png(atomic.path().string(), picture, reason)) {
    throw Error(ErrorKind::file, file.string(), fmt::format("cannot be written as PNG: {}", reason));
  }
  atomic.commit();
  return shown.non_finite;
}

}  // namespace pileus
