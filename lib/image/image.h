#pragma once

#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "lib/math/vec.h"

namespace pileus {

/// One named plane of pixels, row by row from the top: values[y * width + x].
struct Channel {
  std::string name;  ///< as EXR names it: "R", "G", "B", "A", "Z", "transmittance", …
  std::vector<float> values;
};

/// Header entries of an image file. Matrices are row-vector, as OpenEXR stores them.
using ImageMetadata = std::map<std::string, std::variant<std::string, double, int, Imath::M44d>>;

/// A picture as planes of 32-bit floats: linear, colours premultiplied by alpha.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<Channel> channels;
  ImageMetadata metadata;

  size_t pixel_count() const { return size_t(width) * size_t(height); }
  const Channel* find(std::string_view name) const;
  Channel& add(std::string name);  ///< a new channel, filled with 0
};

/// The header entry with a text of any kind, which PNG files keep, too.
inline constexpr const char* kComments = "comments";

/// That text; "" where there is none.
std::string comments_of(const Image& image);

}  // namespace pileus
