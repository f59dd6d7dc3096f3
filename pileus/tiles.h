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
  static constexpr int kBlock = 4;  ///< [pixels] whose rays may be traced in step

  /// corner: of the part of the picture that is rendered. Tiles start at multiples of kBlock of the whole
  /// picture, whatever part of it is rendered, so that the same pixels share a block.
  TileGrid(int width, int height, const Vec2i& corner = {0, 0})
      : m_width(width),
        m_height(height),
        m_shift(corner.x % kBlock, corner.y % kBlock),
        m_columns((width + m_shift.x + kSize - 1) / kSize),
        m_done(size_t(m_columns) * size_t((height + m_shift.y + kSize - 1) / kSize), 0) {}

  size_t count() const { return m_done.size(); }

  /// The tile's pixels in Morton (quadtree) order; tiles at the edges have fewer.
  std::vector<Vec2i> pixels(size_t tile) const {
    std::vector<Vec2i> result;
    for_pixels(tile, [&](const Vec2i& pixel) {
      if (contains(pixel)) result.push_back(pixel);
    });
    return result;
  }

  /// The same, with all pixels of each block of kBlock x kBlock that has one of them: some lie outside.
  std::vector<Vec2i> pixels_of_blocks(size_t tile) const {
    std::vector<Vec2i> result;
    result.reserve(size_t(kSize) * kSize);
    bool has_some = false;
    for_pixels(tile, [&](const Vec2i& pixel) {
      has_some |= contains(pixel);
      result.push_back(pixel);
      constexpr size_t kPixelsOfBlock = size_t(kBlock) * kBlock;
      if (result.size() % kPixelsOfBlock != 0) return;
      if (!has_some) result.resize(result.size() - kPixelsOfBlock);
      has_some = false;
    });
    return result;
  }

  bool contains(const Vec2i& pixel) const {
    return pixel.x >= 0 && pixel.y >= 0 && pixel.x < m_width && pixel.y < m_height;
  }

  bool is_done(size_t tile) const { return m_done[tile] != 0; }
  void set_done(size_t tile) {
    m_done_count += m_done[tile] == 0;
    m_done[tile] = 1;
  }
  double share_done() const { return double(m_done_count) / double(count()); }

 private:
  template <class Visit>
  void for_pixels(size_t tile, Visit&& visit) const {
    const Vec2i corner(int(tile % size_t(m_columns)) * kSize, int(tile / size_t(m_columns)) * kSize);
    for (unsigned code = 0; code < unsigned(kSize * kSize); ++code)
      visit(corner - m_shift + Vec2i(even_bits(code), even_bits(code >> 1)));
  }

  /// Bits 0, 2, 4 and 6 of a Morton code.
  static int even_bits(unsigned code) {
    return int((code & 1) | ((code >> 1) & 2) | ((code >> 2) & 4) | ((code >> 3) & 8));
  }

  int m_width, m_height;
  Vec2i m_shift;  ///< from the first tile's corner to the rendered part's
  int m_columns;
  std::vector<char> m_done;  ///< char, not bool: threads set neighbouring tiles
  size_t m_done_count = 0;
};

}  // namespace pileus
