#include "lib/texture/texture_filter.h"

#include <algorithm>
#include <cmath>

namespace pileus {
namespace {

constexpr double kMaxStretch = 64.0;
constexpr double kMaxPlaces = 16.0;

/// An edge of an area in texels; at most the whole picture, also where it is no number.
Vec2d in_texels(const Vec2d& edge, const TexelGrid& picture) {
  const auto cut = [](double e) { return e > -1.0 ? std::min(e, 1.0) : -1.0; };
  return {cut(edge.x) * picture.width, cut(edge.y) * picture.height};
}

Texel nearest(const TexelGrid& picture, const Vec2d& uv, const Wraps& wraps) {
  const int x = std::min(int(wrap_place(uv.x, wraps.u) * picture.width), picture.width - 1);
  const int y = std::min(int(wrap_place(uv.y, wraps.v) * picture.height), picture.height - 1);
  return picture.at(x, y);
}

}  // namespace

SurfaceArea seen_area(const Vec3d& n, const Vec3d& wo, double width) {
  const Vec3d along = wo - dot(wo, n) * n;
  const double sine = length(along);
  // Seen from straight above, every direction is as good.
  const Vec3d off_axis = std::fabs(n.x) < 0.5 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d direction = sine > 1e-8 ? along / sine : normalize(cross(n, off_axis));
  const double stretch = std::min(1.0 / std::fabs(dot(wo, n)), kMaxStretch);
  return {direction * (width * stretch), cross(n, direction) * width};
}

Texel filtered(const MipPyramid& pyramid, const Vec2d& uv, const PictureArea& area, const Wraps& wraps,
               TextureFilter filter) {
  const TexelGrid& picture = pyramid.level(0);
  if (filter == TextureFilter::nearest) return nearest(picture, uv, wraps);
  const Vec2d a = in_texels(area.a, picture), b = in_texels(area.b, picture);
  const double longer = std::max({a.length(), b.length(), 1.0});
  if (filter == TextureFilter::bilinear) {
    return pyramid.bilinear(std::min(int(std::lround(std::log2(longer))), pyramid.top()), uv, wraps);
  }
  const double narrow = std::max({std::fabs(a.x * b.y - a.y * b.x) / longer, longer / kMaxPlaces, 1.0});
  const double level = std::log2(narrow);
  const int places = int(std::ceil(longer / narrow - 1e-9));
  if (places <= 1) return pyramid.trilinear(level, uv, wraps);
  // The squares at the outermost places end where the area ends.
  const Vec2d edge = a.length2() >= b.length2() ? a : b;
  const Vec2d reach = Vec2d(edge.x / picture.width, edge.y / picture.height) * (1.0 - narrow / longer);
  Texel sum(0.0F);
  for (int i = 0; i < places; ++i) {
    const double along = double(i) / double(places - 1) - 0.5;
    sum += pyramid.trilinear(level, uv + reach * along, wraps);
  }
  return sum * float(1.0 / places);
}

}  // namespace pileus
