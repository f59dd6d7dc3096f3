#include "lib/image/difference_image.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/core/error.h"
#include "lib/image/channel_pairs.h"
#include "lib/image/display.h"

namespace pileus {
namespace {

/// The largest difference of a pixel's channels, with its sign; NaN where one cannot be compared.
double largest_difference(const std::vector<ChannelPair>& pairs, size_t pixel) {
  double largest = 0.0;
  for (const ChannelPair& pair : pairs) {
    const float x = (*pair.test)[pixel], r = (*pair.reference)[pixel];
    if (!is_comparable(x, r)) return std::numeric_limits<double>::quiet_NaN();
    const double difference = signed_difference(x, r);
    if (std::abs(difference) > std::abs(largest)) largest = difference;
  }
  return largest;
}

/// Red above 0, blue below, as linear values.
Rgb colour_of(double relative_difference) {
  if (std::isnan(relative_difference)) return Rgb(relative_difference);
  const double faded = linear_from_srgb(1.0 - std::min(std::abs(relative_difference), 1.0));
  return relative_difference >= 0.0 ? Rgb(1.0, faded, faded) : Rgb(faded, faded, 1.0);
}

}  // namespace

Image difference_image(const Image& test, const Image& reference, double scale, std::string_view channel) {
  PILEUS_CHECK(scale > 0.0);
  const std::vector<ChannelPair> pairs = channel_pairs(test, reference, channel);
  Image picture{test.width, test.height, {}, {{"difference_scale", scale}}};
  for (const char* name : {"R", "G", "B"}) picture.add(name);
  for (size_t i = 0; i < picture.pixel_count(); ++i) {
    const Rgb colour = colour_of(largest_difference(pairs, i) / scale);
    for (int c = 0; c < 3; ++c) picture.channels[size_t(c)].values[i] = float(colour[c]);
  }
  return picture;
}

}  // namespace pileus
