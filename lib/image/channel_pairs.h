#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lib/image/image.h"

namespace pileus {

/// A channel that two pictures have in common. Points into them.
struct ChannelPair {
  std::string name;
  const std::vector<float>* test;
  const std::vector<float>* reference;
};

/// What a comparison of two pictures looks at: the channel called `channel`, or where that is empty their
/// common colours, which are R, G and B, or else Y. errors: Error(file) where the sizes differ or nothing is
/// in common; Error(usage) where one has no such channel
std::vector<ChannelPair> channel_pairs(const Image& test, const Image& reference, std::string_view channel);

/// Whether a difference can be stated: both finite, or both the same infinity (then it is 0).
bool is_comparable(float test, float reference);

/// test - reference of two comparable values, without rounding to float.
double signed_difference(float test, float reference);

}  // namespace pileus
