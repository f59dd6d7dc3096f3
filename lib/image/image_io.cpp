#include "lib/image/image_io.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <string_view>
#include <system_error>

#include <OpenImageIO/imageio.h>

#include "lib/core/error.h"
#include "lib/image/image_limits.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) {
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  }
  return extension;
}

[[noreturn]] void refuse(const fs::path& file, const std::string& message) {
  throw Error(ErrorKind::file, file.string(), message);
}

/// The content decides, so that a PNG picture named .exr is read as what it is.
bool is_exr(const fs::path& file) {
  constexpr std::array<char, 4> kMagic{0x76, 0x2f, 0x31, 0x01};
  std::array<char, 4> start{};
  std::ifstream(file, std::ios::binary).read(start.data(), start.size());
  return start == kMagic;
}

/// From stored to linear values.
using Decode = std::function<double(double)>;

Decode decode_of(const OIIO::ImageSpec& spec) {
  const Decode as_stored = [](double value) { return value; };
  if (spec.format.is_floating_point()) return as_stored;
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  if (OIIO::Strutil::iequals(space, "linear")) return as_stored;
  if (!OIIO::Strutil::istarts_with(space, "gamma")) return linear_from_srgb;
  const double gamma = spec.get_float_attribute("oiio:Gamma", 2.2f);
  return [gamma](double value) { return value > 0.0 ? std::pow(value, gamma) : value; };
}

/// Splits interleaved stored values into linear channels.
Image image_of(const OIIO::ImageSpec& spec, const std::vector<float>& stored) {
  Image image{spec.width, spec.height, {}, {}};
  const Decode decode = decode_of(spec);
  for (int c = 0; c < spec.nchannels; ++c) {
    std::vector<float>& values = image.add(spec.channelnames[size_t(c)]).values;
    for (size_t i = 0; i < values.size(); ++i) {
      const float value = stored[i * size_t(spec.nchannels) + size_t(c)];
      values[i] = c == spec.alpha_channel ? value : float(decode(value));
    }
  }
  return image;
}

void premultiply(Image& image, int alpha_channel) {
  const std::vector<float> alpha = image.channels[size_t(alpha_channel)].values;
  for (int c = 0; c < int(image.channels.size()); ++c) {
    if (c == alpha_channel) continue;
    std::vector<float>& values = image.channels[size_t(c)].values;
    std::transform(values.begin(), values.end(), alpha.begin(), values.begin(), std::multiplies<>());
  }
}

Image read_by_oiio(const fs::path& file) {
  OIIO::ImageSpec wanted;
  wanted.attribute("oiio:UnassociatedAlpha", 1);  // multiplying before linearising would be wrong
  const auto input = OIIO::ImageInput::open(file.string(), &wanted);
  if (!input) refuse(file, fmt::format("cannot be read as a picture: {}", OIIO::geterror()));

  const OIIO::ImageSpec spec = input->spec();
  if (spec.depth > 1) refuse(file, fmt::format("is a volume of {} slices; expected a picture", spec.depth));
  check_image_size(file, spec.width, spec.height, spec.nchannels);
  std::vector<float> stored(size_t(spec.width) * size_t(spec.height) * size_t(spec.nchannels));
  const bool is_read = input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, stored.data());
  // A truncated TIFF file counts as read, black where it is cut off; only the message gives it away.
  const std::string reason = input->geterror();
  if (!is_read || !reason.empty()) {
    refuse(file, fmt::format("is damaged: {}", reason.substr(0, reason.find('\n'))));
  }

  Image image = image_of(spec, stored);
  const bool is_straight = spec.get_int_attribute("oiio:UnassociatedAlpha") != 0;
  if (is_straight && spec.alpha_channel >= 0) premultiply(image, spec.alpha_channel);
  return image;
}

}  // namespace

Image read_image(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) refuse(file, "does not exist; expected a picture");
  if (!fs::is_regular_file(status)) refuse(file, "is no regular file; expected a picture");
  return is_exr(file) ? read_exr(file) : read_by_oiio(file);
}

void check_image_name(const fs::path& file) {
  static const std::vector<std::string> kExtensions{".exr", ".png"};
  const std::string extension = lower_extension(file);
  if (std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end()) return;
  const std::string nearest = nearest_name(extension, kExtensions);
  throw Error(ErrorKind::usage, file.string(),
              fmt::format("the name ends in \"{}\"; expected {}{}", file.extension().string(),
                          join_or(kExtensions), nearest.empty() ? "" : "; nearest: " + nearest));
}

NonFinitePixels write_image(const fs::path& file, const Image& image, const WriteImageOptions& options) {
  check_image_name(file);
  if (lower_extension(file) == ".png") return write_png(file, image, options.display);
  write_exr(file, image, options.exr);
  return {};
}

}  // namespace pileus
