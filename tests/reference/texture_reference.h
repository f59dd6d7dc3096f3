#pragma once

#include <cmath>
#include <cstdlib>

#include "lib/texture/mip_pyramid.h"

// Slow twins of lib/texture in double precision, written from what its headers promise.

namespace pileus::reference {

using Texel64 = Imath::V4d;

/// Texel i of an endless row.
inline int endless_texel(long i, int count, Wrap wrap) {
  if (wrap == Wrap::clamp) return int(i < 0 ? 0 : i >= count ? count - 1 : i);
  const long period = wrap == Wrap::repeat ? count : 2 * count;
  const long within = ((i % period) + period) % period;
  return int(within < count ? within : period - 1 - within);
}

/// Interpolated between texel centres of the endless plane.
inline Texel64 bilinear(const TexelGrid& grid, const Vec2d& uv, const Wraps& wraps) {
  const double x = uv.x * grid.width - 0.5, y = uv.y * grid.height - 0.5;
  Texel64 sum(0.0);
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const long column = long(std::floor(x)) + i, row = long(std::floor(y)) + j;
      const double weight = (1 - std::fabs(x - double(column))) * (1 - std::fabs(y - double(row)));
      sum += weight * Texel64(grid.at(endless_texel(column, grid.width, wraps.u),
                                      endless_texel(row, grid.height, wraps.v)));
    }
  }
  return sum;
}

/// The mean of a rectangle of a picture, edges in texels, texels being squares of one colour.
inline Texel64 box_mean(const TexelGrid& grid, double x0, double x1, double y0, double y1) {
  Texel64 sum(0.0);
  for (int y = int(std::floor(y0)); y < std::ceil(y1); ++y) {
    for (int x = int(std::floor(x0)); x < std::ceil(x1); ++x) {
      const double wide = std::fmin(x + 1, x1) - std::fmax(x, x0);
      const double high = std::fmin(y + 1, y1) - std::fmax(y, y0);
      sum += wide * high * Texel64(grid.at(x, y));
    }
  }
  return sum / ((x1 - x0) * (y1 - y0));
}

}  // namespace pileus::reference
