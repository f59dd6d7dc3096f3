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

}  // namespace pileus
