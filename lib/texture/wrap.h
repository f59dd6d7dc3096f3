#pragma once

#include <algorithm>
#include <cmath>

namespace pileus {

/// What lies beyond the border of a picture.
enum class Wrap {
  clamp,   ///< the nearest texel
  repeat,  ///< the picture again
  mirror,  ///< the picture again, every other one mirrored: no jumps
};

/// The place within the picture, 0 .. 1, that shows what lies at `place`. What is not finite is 0.
inline double wrap_place(double place, Wrap wrap) {
  double inside = 0.0;
  switch (wrap) {
    case Wrap::clamp:
      inside = std::clamp(place, 0.0, 1.0);
      break;
    case Wrap::repeat:
      inside = place - std::floor(place);
      break;
    case Wrap::mirror:
      inside = std::fabs(place - 2.0 * std::round(0.5 * place));
      break;
  }
  return inside >= 0.0 && inside <= 1.0 ? inside : 0.0;  // no number is neither
}

/// The texel that stands for number i, one beyond the border at most, of a row of `count`.
inline int wrap_texel(int i, int count, Wrap wrap) {
  if (wrap == Wrap::repeat) return i < 0 ? i + count : i >= count ? i - count : i;
  return std::clamp(i, 0, count - 1);  // a mirror shows the last texel next to itself
}

}  // namespace pileus
