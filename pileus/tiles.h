#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "lib/math/vec.h"

namespace pileus {

/// The pixels of a square in Morton (quadtree) order, from its corner.
template <int kSize>
constexpr auto morton_order() {
  std::array<std::array<unsigned char, 2>, size_t(kSize) * kSize> order{};
  for (unsigned code = 0; code < order.size(); ++code) {
    for (unsigned bit = 0; 1u << (2 * bit) < order.size(); ++bit) {
      order[code][0] |= static_cast<unsigned char>((code >> (2 * bit) & 1) << bit);
      order[code][1] |= static_cast<unsigned char>((code >> (2 * bit + 1) & 1) << bit);
    }
  }
  return order;
}

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

  /// The part of the tile that is in the picture: [min, max).
  std::pair<Vec2i, Vec2i> bounds(size_t tile) const {
    const Vec2i lo = corner_of(tile), hi = lo + Vec2i(kSize);
    return {{std::max(lo.x, 0), std::max(lo.y, 0)}, {std::min(hi.x, m_width), std::min(hi.y, m_height)}};
  }

  /// The tile's pixels in Morton (quadtree) order; tiles at the edges have fewer.
  std::vector<Vec2i> pixels(size_t tile) const {
    std::vector<Vec2i> result;
    const Vec2i corner = corner_of(tile);
    for (size_t i = 0; i < kMortonOrder.size(); ++i) {
      if (contains(corner + offset(i))) result.push_back(corner + offset(i));
    }
    return result;
  }

  /// The same, with all pixels of each block of kBlock x kBlock that has one of them: some lie outside.
  std::vector<Vec2i> pixels_of_blocks(size_t tile) const {
    constexpr size_t kPixelsOfBlock = size_t(kBlock) * kBlock;
    std::vector<Vec2i> result;
    result.reserve(kMortonOrder.size());
    const Vec2i corner = corner_of(tile);
    for (size_t first = 0; first < kMortonOrder.size(); first += kPixelsOfBlock) {
      const Vec2i lo = corner + offset(first), hi = lo + Vec2i(kBlock - 1);
      if (hi.x < 0 || hi.y < 0 || lo.x >= m_width || lo.y >= m_height) continue;
      for (size_t i = first; i < first + kPixelsOfBlock; ++i) result.push_back(corner + offset(i));
    }
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
  static constexpr auto kMortonOrder = morton_order<kSize>();

  static Vec2i offset(size_t i) { return {kMortonOrder[i][0], kMortonOrder[i][1]}; }

  Vec2i corner_of(size_t tile) const {
    return Vec2i(int(tile % size_t(m_columns)), int(tile / size_t(m_columns))) * kSize - m_shift;
  }

  int m_width, m_height;
  Vec2i m_shift;  ///< from the first tile's corner to the rendered part's
  int m_columns;
  std::vector<char> m_done;  ///< char, not bool: threads set neighbouring tiles
  size_t m_done_count = 0;
};

}  // namespace pileus
