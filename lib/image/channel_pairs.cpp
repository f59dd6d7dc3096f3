#include "lib/image/channel_pairs.h"

#include <array>
#include <cmath>

#include "lib/core/error.h"

namespace pileus {
namespace {

std::vector<std::string> channel_names(const Image& image) {
  std::vector<std::string> names;
  for (const Channel& channel : image.channels) names.push_back(channel.name);
  return names;
}

std::string listed(const Image& image) {
  return image.channels.empty() ? "no channels" : fmt::format("{}", fmt::join(channel_names(image), ", "));
}

const std::vector<float>& require_channel(const Image& image, const char* which, std::string_view name) {
  if (const Channel* channel = image.find(name)) return channel->values;
  const std::string nearest = nearest_name(name, channel_names(image));
  throw Error(ErrorKind::usage, SourceLoc{},
              fmt::format("the {} picture has no channel \"{}\"; found {}{}", which, name, listed(image),
                          nearest.empty() ? "" : "; nearest: " + nearest));
}

}  // namespace

std::vector<ChannelPair> channel_pairs(const Image& test, const Image& reference, std::string_view channel) {
  if (test.width != reference.width || test.height != reference.height) {
    throw Error(ErrorKind::file, SourceLoc{},
                fmt::format("the pictures have {} x {} and {} x {} pixels; expected equal sizes", test.width,
                            test.height, reference.width, reference.height));
  }
  if (!channel.empty()) {
    return {{std::string(channel), &require_channel(test, "first", channel),
             &require_channel(reference, "second", channel)}};
  }
  const std::array<std::vector<std::string>, 2> colours{{{"R", "G", "B"}, {"Y"}}};
  for (const std::vector<std::string>& names : colours) {
    std::vector<ChannelPair> pairs;
    for (const std::string& name : names) {
      const Channel* a = test.find(name);
      const Channel* b = reference.find(name);
      if (a && b) pairs.push_back({name, &a->values, &b->values});
    }
    if (pairs.size() == names.size()) return pairs;
  }
  throw Error(
      ErrorKind::file, SourceLoc{},
      fmt::format("the pictures have no colours in common: found {} against {}; expected R, G and B, or "
                  "Y, in both, or the name of one channel to compare",
                  listed(test), listed(reference)));
}

bool is_comparable(float test, float reference) {
  return (std::isfinite(test) && std::isfinite(reference)) || test == reference;
}

double signed_difference(float test, float reference) {
  return test == reference ? 0.0 : double(test) - double(reference);
}

}  // namespace pileus
