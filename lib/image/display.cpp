#include "lib/image/display.h"

#include <algorithm>
#include <cmath>

#include <OpenImageIO/imageio.h>

#include "lib/core/atomic_file.h"
#include "lib/core/error.h"
#include "lib/core/parallel.h"

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

OIIO::ImageSpec png_spec(const DisplayImage& picture, const DisplayTransform& transform) {
  OIIO::ImageSpec spec(picture.width, picture.height, 3, OIIO::TypeDesc::UINT8);
  const bool is_srgb = transform.curve == DisplayCurve::srgb;
  spec.attribute("oiio:ColorSpace", is_srgb ? "sRGB" : fmt::format("Gamma{:.4g}", transform.gamma));
  return spec;
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
  const DisplayImage picture = to_display(image, transform);
  AtomicFile atomic(file);
  const auto output = OIIO::ImageOutput::create("png");
  const auto require = [&](bool ok) {
    if (ok) return;
    const std::string reason = output ? output->geterror() : OIIO::geterror();
    throw Error(ErrorKind::file, file.string(), fmt::format("cannot be written as PNG: {}", reason));
  };
  require(output != nullptr);
  require(output->open(atomic.path().string(), png_spec(picture, transform)));
  require(output->write_image(OIIO::TypeDesc::UINT8, picture.rgb.data()));
  require(output->close());
  atomic.commit();
  return picture.non_finite;
}

}  // namespace pileus
