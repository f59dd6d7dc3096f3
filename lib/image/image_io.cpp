#include "lib/image/image_io.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <string_view>
#include <system_error>

#include "lib/core/error.h"
#include "lib/image/image_limits.h"
#include "lib/image/load_pictures.h"

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

Decode decode_of(const PictureHeader& header) {
  if (header.curve == StoredCurve::linear) return [](double value) { return value; };
  if (header.curve == StoredCurve::srgb) return linear_from_srgb;
  return [gamma = header.gamma](double value) { return value > 0.0 ? std::pow(value, gamma) : value; };
}

/// Splits interleaved stored values into linear channels.
Image image_of(const PictureHeader& header, const std::vector<float>& stored) {
  Image image{header.width, header.height, {}, {}};
  if (!header.comments.empty()) image.metadata[kComments] = header.comments;
  const Decode decode = decode_of(header);
  const size_t channels = header.channels.size();
  for (size_t c = 0; c < channels; ++c) {
    std::vector<float>& values = image.add(header.channels[c]).values;
    for (size_t i = 0; i < values.size(); ++i) {
      const float value = stored[i * channels + c];
      values[i] = int(c) == header.alpha_channel ? value : float(decode(value));
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

StoredCurve curve_of(const PictureHeader& header, PictureEncoding encoding) {
  if (encoding == PictureEncoding::by_file) return header.curve;
  return encoding == PictureEncoding::srgb ? StoredCurve::srgb : StoredCurve::linear;
}

Image read_picture(const fs::path& file, PictureEncoding encoding) {
  std::string reason;
  const auto reader = load_pictures().open(file.string(), reason);
  if (!reader) refuse(file, fmt::format("cannot be read as a picture: {}", reason));

  PictureHeader header = reader->header();
  header.curve = curve_of(header, encoding);
  if (header.depth > 1)
    refuse(file, fmt::format("is a volume of {} slices; expected a picture", header.depth));
  check_image_size(file, header.width, header.height, int64_t(header.channels.size()));
  std::vector<float> stored(size_t(header.width) * size_t(header.height) * header.channels.size());
  if (!reader->read(stored.data(), reason)) {
    refuse(file, fmt::format("is damaged: {}", reason.substr(0, reason.find('\n'))));
  }

  Image image = image_of(header, stored);
  if (header.is_straight && header.alpha_channel >= 0) premultiply(image, header.alpha_channel);
  return image;
}

/// Linearises the display values of an EXR picture, which are multiplied by alpha.
void decode_srgb(Image& image) {
  const Channel* alpha = image.find("A");
  for (Channel& channel : image.channels) {
    if (&channel == alpha) continue;
    for (size_t i = 0; i < channel.values.size(); ++i) {
      const double share = alpha ? alpha->values[i] : 1.0;
      if (share > 0.0) channel.values[i] = float(share * linear_from_srgb(channel.values[i] / share));
    }
  }
}

Image read_exr_picture(const fs::path& file, PictureEncoding encoding) {
  Image image = read_exr(file);
  if (encoding == PictureEncoding::srgb) decode_srgb(image);
  return image;
}

}  // namespace

Image read_image(const fs::path& file, PictureEncoding encoding) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) refuse(file, "does not exist; expected a picture");
  if (!fs::is_regular_file(status)) refuse(file, "is no regular file; expected a picture");
  return is_exr(file) ? read_exr_picture(file, encoding) : read_picture(file, encoding);
}

void check_image_name(const fs::path& file) {
  static const std::vector<std::string> kExtensions{".exr", ".png"};
  const std::string extension = lower_extension(file);
  if (extension == ".png") load_pictures();  // a long render is not to end with its absence
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
