#include "lib/image/image.h"

#include <utility>

namespace pileus {

const Channel* Image::find(std::string_view name) const {
  for (const Channel& channel : channels) {
    if (channel.name == name) return &channel;
  }
  return nullptr;
}

Channel& Image::add(std::string name) {
  return channels.emplace_back(Channel{std::move(name), std::vector<float>(pixel_count(), 0.0f)});
}

std::string comments_of(const Image& image) {
  const auto found = image.metadata.find(kComments);
  const auto* text = found == image.metadata.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text ? *text : "";
}

}  // namespace pileus
