#pragma once

#include <cmath>
#include <cstddef>

#include "lib/math/vec.h"

namespace pileus {

/// Where pilot ray n looks, in pixels: evenly over the picture for any count, with no two in one row or
/// column. On a raster they would share rows: errors of a cache that gather between two of its planes, along
/// rays that lie in these, would be met by whole rows of pilots or by none. The R2 sequence (Roberts 2018).
inline Vec2d pilot_pixel(size_t n, const Vec2i& picture) {
  constexpr double kAcross = 0.7548776662466927, kDown = 0.5698402909980532;  // 1/x and 1/x^2, x^3 = x + 1
  const auto fraction = [](double x) { return x - std::floor(x); };
  return {fraction(0.5 + double(n) * kAcross) * picture.x, fraction(0.5 + double(n) * kDown) * picture.y};
}

}  // namespace pileus
