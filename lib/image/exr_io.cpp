#include "lib/image/exr_io.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string_view>

#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <half.h>

#include "lib/core/atomic_file.h"
#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/image/image_limits.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;
using Imath::Box2i;

constexpr std::string_view kPrefix = "pileus:";

bool is_conventional_matrix(std::string_view name) {
  return name == "worldToCamera" || name == "worldToNDC";
}

Imf::Compression imf_compression(ExrCompression compression) {
  switch (compression) {
    case ExrCompression::none:
      return Imf::NO_COMPRESSION;
    case ExrCompression::rle:
      return Imf::RLE_COMPRESSION;
    case ExrCompression::zip_line:
      return Imf::ZIPS_COMPRESSION;
    case ExrCompression::zip:
      return Imf::ZIP_COMPRESSION;
    case ExrCompression::piz:
      return Imf::PIZ_COMPRESSION;
  }
  PILEUS_CHECK(!"a compression that is not listed");
  return Imf::NO_COMPRESSION;
}

// ---- writing ----

/// Names come from scenes (a light's, an object's), and OpenEXR would cut what it cannot hold in silence.
void check_name(std::string_view name) {
  constexpr size_t kMaxBytes = 255;
  if (name.size() <= kMaxBytes && name.find('\0') == name.npos) return;
  throw std::runtime_error(
      fmt::format("the name \"{:.32}...\" has {} bytes; expected at most {}, none of them zero", name,
                  name.size(), kMaxBytes));
}

struct AttributeWriter {
  Imf::Header& header;
  const std::string& name;

  std::string prefixed() const {
    std::string result = std::string(kPrefix) + name;
    check_name(result);
    return result;
  }
  void operator()(const std::string& value) const { header.insert(prefixed(), Imf::StringAttribute(value)); }
  void operator()(double value) const { header.insert(prefixed(), Imf::DoubleAttribute(value)); }
  void operator()(int value) const { header.insert(prefixed(), Imf::IntAttribute(value)); }
  void operator()(const Imath::M44d& value) const {
    if (is_conventional_matrix(name)) {
      header.insert(name, Imf::M44fAttribute(Imath::M44f(value)));
    } else {
      header.insert(prefixed(), Imf::M44dAttribute(value));
    }
  }
};

bool is_colour(std::string_view channel) {
  const std::string_view name = channel.substr(channel.rfind('.') + 1);  // npos + 1 is 0
  return name == "R" || name == "G" || name == "B" || name == "A" || name == "Y";
}

bool fits_half(const Channel& channel) {
  return std::none_of(channel.values.begin(), channel.values.end(),
                      [](float value) { return std::isfinite(value) && !half(value).isFinite(); });
}

/// What OpenEXR needs in memory until the file is written; halves own their converted values.
struct EncodedChannels {
  Imf::FrameBuffer frame;
  std::vector<std::vector<half>> halves;
};

EncodedChannels encode_channels(const Image& image, const ExrOptions& options, Imf::Header& header) {
  EncodedChannels encoded;
  const Box2i window = header.dataWindow();
  for (const Channel& channel : image.channels) {
    check_name(channel.name);
    const bool as_half = options.half_colours && is_colour(channel.name) && fits_half(channel);
    const Imf::PixelType type = as_half ? Imf::HALF : Imf::FLOAT;
    const void* values = channel.values.data();
    if (as_half) {
      values = encoded.halves.emplace_back(channel.values.begin(), channel.values.end()).data();
    }
    header.channels().insert(channel.name, Imf::Channel(type));
    encoded.frame.insert(channel.name, Imf::Slice::Make(type, values, window));
  }
  return encoded;
}

/// OpenEXR writes its table of offsets from a destructor, which swallows errors; the stream remembers them.
void write_pixels(const fs::path& path, const Imf::Header& header, const Imf::FrameBuffer& frame) {
  // Blocks are compressed side by side; the file is the same for any number of threads.
  const int threads = thread_count() > 1 ? thread_count() : 0;
  if (Imf::globalThreadCount() < threads) Imf::setGlobalThreadCount(threads);
  std::ofstream file(path, std::ios::binary);
  {
    Imf::StdOFStream stream(file, path.c_str());
    Imf::OutputFile output(stream, header, threads);
    output.setFrameBuffer(frame);
    output.writePixels(header.dataWindow().size().y + 1);
  }
  file.close();
  if (!file) throw std::runtime_error("the file system refused a part of it; is the disk full?");
}

void check_invariants(const Image& image) {
  PILEUS_CHECK(image.width > 0 && image.height > 0 && !image.channels.empty());
  std::set<std::string_view> names;
  for (const Channel& channel : image.channels) {
    PILEUS_CHECK(channel.values.size() == image.pixel_count());
    PILEUS_CHECK(!channel.name.empty() && names.insert(channel.name).second);
  }
}

// ---- reading ----

void read_attribute(const std::string& name, const Imf::Attribute& attribute, ImageMetadata& metadata) {
  if (is_conventional_matrix(name)) {
    if (auto* matrix = dynamic_cast<const Imf::M44fAttribute*>(&attribute)) {
      metadata[name] = Imath::M44d(matrix->value());
    }
    return;
  }
  if (name.rfind(kPrefix, 0) != 0) return;
  auto& value = metadata[name.substr(kPrefix.size())];
  if (auto* text = dynamic_cast<const Imf::StringAttribute*>(&attribute)) value = text->value();
  if (auto* number = dynamic_cast<const Imf::DoubleAttribute*>(&attribute)) value = number->value();
  if (auto* integer = dynamic_cast<const Imf::IntAttribute*>(&attribute)) value = integer->value();
  if (auto* matrix = dynamic_cast<const Imf::M44dAttribute*>(&attribute)) value = matrix->value();
}

Vec2i size_of(const Box2i& window) {
  return window.max - window.min + Vec2i(1);  // OpenEXR refuses windows whose size overflows an int
}

/// `values` of the window `from`, cut or padded with 0 to the window `to`.
std::vector<float> rewindow(std::vector<float> values, const Box2i& from, const Box2i& to) {
  if (from == to) return values;
  const Vec2i from_size = size_of(from), to_size = size_of(to);
  const int x0 = std::max(from.min.x, to.min.x), x1 = std::min(from.max.x, to.max.x);
  const int y0 = std::max(from.min.y, to.min.y), y1 = std::min(from.max.y, to.max.y);
  std::vector<float> result(size_t(to_size.x) * size_t(to_size.y), 0.0f);
  for (int y = y0; y <= y1 && x0 <= x1; ++y) {
    const float* row = values.data() + size_t(y - from.min.y) * size_t(from_size.x) + (x0 - from.min.x);
    float* target = result.data() + size_t(y - to.min.y) * size_t(to_size.x) + (x0 - to.min.x);
    std::copy(row, row + (x1 - x0 + 1), target);
  }
  return result;
}

Image read_pixels(const fs::path& file, Imf::InputFile& input) {
  const Imf::Header& header = input.header();
  const Box2i data = header.dataWindow(), display = header.displayWindow();

  Image image;
  for (auto i = header.channels().begin(); i != header.channels().end(); ++i) {
    if (i.channel().xSampling != 1 || i.channel().ySampling != 1) {
      throw Error(ErrorKind::file, file.string(),
                  fmt::format("channel \"{}\" is subsampled; expected one value per pixel", i.name()));
    }
    image.channels.push_back({i.name(), {}});
  }
  for (const Box2i& window : {data, display}) {
    check_image_size(file, size_of(window).x, size_of(window).y, int64_t(image.channels.size()));
  }

  Imf::FrameBuffer frame;
  for (Channel& channel : image.channels) {
    channel.values.resize(size_t(size_of(data).x) * size_t(size_of(data).y));
    frame.insert(channel.name, Imf::Slice::Make(Imf::FLOAT, channel.values.data(), data));
  }
  input.setFrameBuffer(frame);
  input.readPixels(data.min.y, data.max.y);

  image.width = size_of(display).x;
  image.height = size_of(display).y;
  for (Channel& channel : image.channels) channel.values = rewindow(std::move(channel.values), data, display);
  for (auto i = header.begin(); i != header.end(); ++i) {
    read_attribute(i.name(), i.attribute(), image.metadata);
  }
  return image;
}

}  // namespace

void write_exr(const fs::path& file, const Image& image, const ExrOptions& options) {
  check_invariants(image);
  AtomicFile atomic(file);
  try {
    Imf::Header header(image.width, image.height);
    header.compression() = imf_compression(options.compression);
    // Of a cloud the usual level, 4, makes files 3 % smaller, in twice the time.
    header.zipCompressionLevel() = 2;
    for (const auto& [name, value] : image.metadata) std::visit(AttributeWriter{header, name}, value);
    const EncodedChannels encoded = encode_channels(image, options, header);
    write_pixels(atomic.path(), header, encoded.frame);
  } catch (const std::exception& error) {
    throw Error(ErrorKind::file, file.string(), fmt::format("cannot be written as EXR: {}", error.what()));
  }
  atomic.commit();
}

Image read_exr(const fs::path& file) {
  try {
    Imf::InputFile input(file.c_str());
    return read_pixels(file, input);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(ErrorKind::file, file.string(), fmt::format("cannot be read as EXR: {}", error.what()));
  }
}

}  // namespace pileus
