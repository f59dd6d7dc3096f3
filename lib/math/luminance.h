#pragma once

#include "lib/math/vec.h"

namespace pileus {

/// Luminance of a linear colour: the Rec. 709 weights, which sum to 1.
inline double luminance(const Rgb& color) {
  return 0.2126 * color.x + 0.7152 * color.y + 0.0722 * color.z;
}

}  // namespace pileus
