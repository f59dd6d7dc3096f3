#include "lib/image/pictures/pictures.h"

#include <algorithm>
#include <fstream>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "lib/core/version.h"

namespace pileus {
namespace {

struct Curve {
  StoredCurve kind = StoredCurve::linear;
  double gamma = 1.0;
};

Curve curve_of(const OIIO::ImageSpec& spec) {
  if (spec.format.is_floating_point()) return {};
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  if (OIIO::Strutil::iequals(space, "linear")) return {};
  if (!OIIO::Strutil::istarts_with(space, "gamma")) return {StoredCurve::srgb};
  return {StoredCurve::gamma, spec.get_float_attribute("oiio:Gamma", 2.2f)};
}

PictureHeader header_of(const OIIO::ImageSpec& spec) {
  const Curve curve = curve_of(spec);
  PictureHeader header;
  header.width = spec.width;
  header.height = spec.height;
  header.depth = spec.depth;
  header.channels = spec.channelnames;
  header.alpha_channel = spec.alpha_channel;
  header.is_straight = spec.get_int_attribute("oiio:UnassociatedAlpha") != 0;
  header.curve = curve.kind;
  header.gamma = curve.gamma;
  header.comments = spec.get_string_attribute("ImageDescription");
  return header;
}

class OiioReader final : public PictureReader {
 public:
  explicit OiioReader(std::unique_ptr<OIIO::ImageInput> input)
      : m_input(std::move(input)), m_header(header_of(m_input->spec())) {}

  const PictureHeader& header() const override { return m_header; }

  bool read(float* values, std::string& reason) override {
    const int channels = int(m_header.channels.size());
    const bool is_read = m_input->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, values);
    // A truncated TIFF file counts as read, black where it is cut off; only the message gives it away.
    reason = m_input->geterror();
    return is_read && reason.empty();
  }

  bool read_numbers(float* values, std::string& reason) override {
    switch (m_input->spec().format.basetype) {
      case OIIO::TypeDesc::UINT8:
        return read_as<uint8_t>(values, reason);
      case OIIO::TypeDesc::INT8:
        return read_as<int8_t>(values, reason);
      case OIIO::TypeDesc::UINT16:
        return read_as<uint16_t>(values, reason);
      case OIIO::TypeDesc::INT16:
        return read_as<int16_t>(values, reason);
      case OIIO::TypeDesc::UINT32:
        return read_as<uint32_t>(values, reason);
      case OIIO::TypeDesc::INT32:
        return read_as<int32_t>(values, reason);
      case OIIO::TypeDesc::DOUBLE:
        return read_as<double>(values, reason);
      default:
        return read(values, reason);
    }
  }

 private:
  template <class Stored>
  bool read_as(float* values, std::string& reason) {
    const size_t channels = m_header.channels.size();
    std::vector<Stored> stored(size_t(m_header.width) * size_t(m_header.height) * channels);
    const bool is_read = m_input->read_image(0, 0, 0, int(channels), m_input->spec().format, stored.data());
    reason = m_input->geterror();
    std::transform(stored.begin(), stored.end(), values, [](Stored value) { return float(value); });
    return is_read && reason.empty();
  }

  std::unique_ptr<OIIO::ImageInput> m_input;
  PictureHeader m_header;
};

std::string colour_space(const PngPicture& picture) {
  if (picture.curve == StoredCurve::linear) return "linear";
  if (picture.curve == StoredCurve::srgb) return "sRGB";
  return OIIO::Strutil::fmt::format("Gamma{:.4g}", picture.gamma);
}

/// OpenImageIO's own writing of PNG files does not notice a full disk.
bool write_bytes(const std::string& file, const std::vector<unsigned char>& bytes, std::string& reason) {
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  stream.close();
  if (!stream) reason = "the file system refused a part of it; is the disk full?";
  return bool(stream);
}

class OiioPictures final : public Pictures {
 public:
  std::unique_ptr<PictureReader> open(const std::string& file, std::string& reason) const override {
    OIIO::ImageSpec wanted;
    wanted.attribute("oiio:UnassociatedAlpha", 1);  // multiplying before linearising would be wrong
    auto input = OIIO::ImageInput::open(file, &wanted);
    if (input) return std::make_unique<OiioReader>(std::move(input));
    reason = OIIO::geterror();
    return nullptr;
  }

  bool write_png(const std::string& file, const PngPicture& picture, std::string& reason) const override {
    OIIO::ImageSpec spec(picture.width, picture.height, 3, OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:ColorSpace", colour_space(picture));
    if (!picture.comments.empty()) spec.attribute("ImageDescription", picture.comments);
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    const auto output = OIIO::ImageOutput::create("png");
    const bool is_encoded = output && output->set_ioproxy(&memory) && output->open(file, spec) &&
                            output->write_image(OIIO::TypeDesc::UINT8, picture.rgb) && output->close();
    if (!is_encoded) {
      reason = output ? output->geterror() : OIIO::geterror();
      return false;
    }
    return write_bytes(file, bytes, reason);
  }
};

}  // namespace
}  // namespace pileus

extern "C" const char* pileus_pictures_version() {
  return pileus::kVersion;
}

extern "C" const pileus::Pictures* pileus_pictures() {
  static const pileus::OiioPictures pictures;
  return &pictures;
}
