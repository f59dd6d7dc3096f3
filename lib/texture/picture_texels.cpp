#include "lib/texture/picture_texels.h"

#include <array>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"

namespace pileus {
namespace {

/// The channels that give red, green, blue and alpha; null: no alpha.
std::array<const Channel*, 4> texel_channels(const Image& image, const std::filesystem::path& file) {
  const Channel *red = image.find("R"), *green = image.find("G"), *blue = image.find("B");
  if (red && green && blue) return {red, green, blue, image.find("A")};
  if (const Channel* grey = image.find("Y")) return {grey, grey, grey, image.find("A")};
  std::vector<std::string> names;
  for (const Channel& channel : image.channels) names.push_back(channel.name);
  throw Error(ErrorKind::file, file.string(),
              fmt::format("has the channels {}; expected R, G and B, or Y", join_or(names)));
}

}  // namespace

TexelGrid read_texels(const std::filesystem::path& file, PictureEncoding encoding) {
  const Image image = read_image(file, encoding);
  require_memory(file.string(), "the texture", pyramid_bytes(image.width, image.height));
  const std::array<const Channel*, 4> channels = texel_channels(image, file);
  TexelGrid grid{image.width, image.height, std::vector<Texel>(image.pixel_count(), Texel(1.0F))};
  for (size_t c = 0; c < channels.size(); ++c) {
    if (!channels[c]) continue;
    for (size_t i = 0; i < grid.texels.size(); ++i) {
      const float value = channels[c]->values[i];
      if (!(value >= 0.0F && value <= 1.0F)) {
        throw Error(ErrorKind::file, file.string(),
                    fmt::format("channel {} is {} at pixel ({}, {}); expected 0 to 1", channels[c]->name,
                                value, i % size_t(image.width), i / size_t(image.width)));
      }
      grid.texels[i][int(c)] = value;
    }
  }
  return grid;
}

}  // namespace pileus
