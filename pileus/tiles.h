#pragma once

#include <cstddef>
#include <vector>

#include "lib/math/vec.h"

namespace pileus {

/// The square tiles of a picture, and which of them are done.
class TileGrid {
 public:
  static constexpr int kSize =
      16;  ///< [pixels]; 256 rays: enough to fill packets, small enough to balance threads

  TileGrid(int width, int height)
      : m_width(width),
        m_height(height),
        m_columns((width + kSize - 1) / kSize),
        m_done(size_t(m_columns) * size_t((height + kSize - 1) / kSize), 0) {}

  size_t count() const { return m_done.size(); }

  /// The tile's pixels in Morton (quadtree) order; tiles at the right and lower edge have fewer.
  std::vector<Vec2i> pixels(size_t tile) const {
    const Vec2i corner(int(tile % size_t(m_columns)) * kSize, int(tile / size_t(m_columns)) * kSize);
    std::vector<Vec2i> result;
    for (unsigned code = 0; code < unsigned(kSize * kSize); ++code) {
      const Vec2i pixel = corner + Vec2i(even_bits(code), even_bits(code >> 1));
      if (pixel.x < m_width && pixel.y < m_height) result.push_back(pixel);
    }
    return result;
  }

  bool is_done(size_t tile) const { return m_done[tile] != 0; }
  void set_done(size_t tile) {
    m_done_count += m_done[tile] == 0;
    m_done[tile] = 1;
  }
  double share_done() const { return double(m_done_count) / double(count()); }

 private:
  /// Bits 0, 2, 4 and 6 of a Morton code.
  static int even_bits(unsigned code) {
    return int((code & 1) | ((code >> 1) & 2) | ((code >> 2) & 4) | ((code >> 3) & 8));
  }

  int m_width, m_height, m_columns;
  std::vector<char> m_done;  ///< char, not bool: threads set neighbouring tiles
  size_t m_done_count = 0;
};

}  // namespace pileus
