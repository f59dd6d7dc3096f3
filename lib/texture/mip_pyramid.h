#pragma once

#include <cstdint>
#include <vector>

#include <ImathVec.h>

#include "lib/math/vec.h"
#include "lib/texture/wrap.h"

namespace pileus {

/// Red, green, blue and alpha (x, y, z, w): linear, colours multiplied by alpha.
using Texel = Imath::V4f;

/// Texels row by row from the top: texels[y * width + x].
struct TexelGrid {
  int width = 0;
  int height = 0;
  std::vector<Texel> texels;

  const Texel& at(int x, int y) const { return texels[size_t(y) * size_t(width) + size_t(x)]; }
};

/// How pictures go on beyond their borders.
struct Wraps {
  Wrap u = Wrap::repeat, v = Wrap::repeat;
};

/// A picture at sizes from its own (level 0) down to one texel, each half the one before, rounded down. A
/// texel is the mean of the part of the level before that it covers, down to shares of texels: where sizes
/// are powers of two that is the mean of the picture itself, and at all sizes the mean of a level is that of
/// the picture. ref: Williams 1983, Pyramidal parametrics
/// threads: const, safe from many threads
class MipPyramid {
 public:
  MipPyramid() = default;

  /// picture: at least one texel
  explicit MipPyramid(TexelGrid picture);

  int top() const { return int(m_levels.size()) - 1; }
  const TexelGrid& level(int level) const { return m_levels[size_t(level)]; }

  /// Interpolated between the centres of the four nearest texels of a level. Within 4e-7 of the largest of
  /// them, as all weights are single.
  ///   uv: from the left and the top, 0 .. 1 in the picture; any
  Texel bilinear(int level, const Vec2d& uv, const Wraps& wraps) const;

  /// Between two levels: 1.25 is a quarter of the way from level 1 to level 2. Levels beyond the ends are the
  /// ends.
  Texel trilinear(double level, const Vec2d& uv, const Wraps& wraps) const;

 private:
  std::vector<TexelGrid> m_levels;
};

/// What a pyramid takes [bytes].
uint64_t pyramid_bytes(int width, int height);

}  // namespace pileus
