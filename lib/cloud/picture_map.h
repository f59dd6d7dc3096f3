#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lib/image/image.h"
#include "lib/math/interval.h"
#include "lib/math/vec.h"

namespace pileus {

class ParamTable;

/// How a picture becomes a function of space: `coverage_map = { file = "map.png" }` in a cloud.
struct PictureMapRecipe {
  std::filesystem::path file;  ///< empty: no picture
  std::string channel = "luminance";
  bool inverse = false;  ///< 1 - channel. A quotient by the channel would have no bound where it is 0.
  Vec2d levels{0.0, 1.0};
  std::string projection = "planar";
  Vec3d axis{0.0, 1.0, 0.0};  ///< planar: the picture is the same all along it; spherical: its poles
  Vec2d tiles{1.0, 1.0};
  double turn_deg = 0.0;  ///< about the axis

  bool operator==(const PictureMapRecipe&) const = default;
  bool is_used() const { return !file.empty(); }
  void describe(ParamTable& params);
  void check(std::vector<std::string>& problems, const char* owner) const;
};

/// A channel of a picture as a function of space, 0 .. 1, interpolated bilinearly between the centres of the
/// texels; the picture repeats without end. (Amorphous 2015, "Texture": density proportional or inverse to
/// the colour, or from a separate map.)
///   planar     the picture fills the box's extent across the axis, `tiles` times along each side
///   spherical  longitude and latitude about the box's centre, seen along the axis
/// threads: const, safe from many threads
class PictureMap {
 public:
  /// box: what the picture is fitted to [m], finite and not flat
  /// errors: as read_image; Error(file) where the picture lacks the channel or holds values that are not
  /// finite
  PictureMap(const PictureMapRecipe& recipe, const Box3d& box_world);

  /// The channel at a point of world space, 0 .. 1.
  double value(const Vec3d& p_world) const;

  /// Bounds of value() over a box of world space.
  Interval range(const Box3d& box_world) const;

  /// The picture's colour at a point of world space, linear.
  Rgb color(const Vec3d& p_world) const;

 private:
  /// Place in the picture, in texels; (0, 0) is the centre of the first one.
  Vec2d place(const Vec3d& p_world) const;

  /// Boxes of places that hold those of all points of a box.
  struct Places {
    Interval u, v;
  };
  Places places(const Box3d& box_world) const;

  double sample(const std::vector<float>& values, const Vec2d& place) const;
  /// Of places between the same four texels: what is bilinear has its extremes at corners.
  Interval corner_range(const Places& places) const;
  Interval texel_range(const Places& places) const;

  /// The least and the greatest texel of each square of 2^level texels.
  struct Level {
    int width = 0, height = 0;
    std::vector<float> lo, hi;
  };
  void build_pyramid();

  PictureMapRecipe m_recipe;
  Vec3d m_center, m_u, m_v, m_w;  ///< world to texels: place = dot(p - center, m_u), dot(.., m_v) + middle
  int m_width = 0, m_height = 0;
  std::vector<float> m_values;
  std::array<std::vector<float>, 3> m_colors;
  std::vector<Level> m_levels;
};

}  // namespace pileus
