#include "lib/texture/mip_pyramid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "lib/core/parallel.h"

namespace pileus {
namespace {

/// The texels of a row that one texel of half as many covers, and how much of each.
struct Share {
  int first = 0, count = 0;
  std::array<double, 4> weights{};  ///< sum 1
};

/// Texel i of `coarse` covers fine / coarse texels, 2 to 3 (1 where there is one only).
std::vector<Share> shares(int fine, int coarse) {
  std::vector<Share> result(size_t(coarse), Share{});
  for (int i = 0; i < coarse; ++i) {
    Share& share = result[size_t(i)];
    const int64_t begin = int64_t(i) * fine, end = begin + fine;  // in units of 1 / coarse
    share.first = int(begin / coarse);
    for (int64_t at = begin; at < end;) {
      const int64_t next = std::min(end, (at / coarse + 1) * coarse);
      share.weights[size_t(share.count++)] = double(next - at) / double(fine);
      at = next;
    }
  }
  return result;
}

TexelGrid halved(const TexelGrid& fine) {
  TexelGrid coarse{std::max(1, fine.width / 2), std::max(1, fine.height / 2), {}};
  coarse.texels.resize(size_t(coarse.width) * size_t(coarse.height));
  const std::vector<Share> columns = shares(fine.width, coarse.width);
  const std::vector<Share> rows = shares(fine.height, coarse.height);
  parallel_for(size_t(coarse.height), [&](size_t y) {
    for (size_t x = 0; x < size_t(coarse.width); ++x) {
      Imath::V4d sum(0.0);
      for (int j = 0; j < rows[y].count; ++j) {
        for (int i = 0; i < columns[x].count; ++i) {
          const double weight = rows[y].weights[size_t(j)] * columns[x].weights[size_t(i)];
          sum += Imath::V4d(fine.at(columns[x].first + i, rows[y].first + j)) * weight;
        }
      }
      coarse.texels[y * size_t(coarse.width) + x] = Texel(sum);
    }
  });
  return coarse;
}

/// The two texels around a place on a row and the share of the second.
struct Pair {
  int first, second;
  float share;
};

Pair texel_pair(double place, int count, Wrap wrap) {
  const double texel = wrap_place(place, wrap) * count - 0.5;
  const double whole = std::floor(texel);
  return {wrap_texel(int(whole), count, wrap), wrap_texel(int(whole) + 1, count, wrap), float(texel - whole)};
}

}  // namespace

MipPyramid::MipPyramid(TexelGrid picture) {
  m_levels.push_back(std::move(picture));
  while (m_levels.back().width > 1 || m_levels.back().height > 1) m_levels.push_back(halved(m_levels.back()));
}

Texel MipPyramid::bilinear(int level, const Vec2d& uv, const Wraps& wraps) const {
  const TexelGrid& grid = m_levels[size_t(level)];
  const Pair x = texel_pair(uv.x, grid.width, wraps.u), y = texel_pair(uv.y, grid.height, wraps.v);
  const Texel upper = grid.at(x.first, y.first) * (1 - x.share) + grid.at(x.second, y.first) * x.share;
  const Texel lower = grid.at(x.first, y.second) * (1 - x.share) + grid.at(x.second, y.second) * x.share;
  return upper * (1 - y.share) + lower * y.share;
}

Texel MipPyramid::trilinear(double level, const Vec2d& uv, const Wraps& wraps) const {
  const double within = std::clamp(level, 0.0, double(top()));
  const int finer = int(within);
  const float share = float(within - finer);
  const Texel fine = bilinear(finer, uv, wraps);
  if (share == 0.0F) return fine;
  return fine * (1 - share) + bilinear(finer + 1, uv, wraps) * share;
}

uint64_t pyramid_bytes(int width, int height) {
  return (uint64_t(width) * uint64_t(height) * 4 / 3 + uint64_t(width) + uint64_t(height)) * sizeof(Texel);
}

}  // namespace pileus
