#pragma once

#include <optional>

#include "lib/core/registry.h"
#include "lib/math/beam.h"
#include "lib/math/ray.h"
#include "lib/math/vec.h"

namespace pileus {

struct Camera : Plugin {
  static constexpr const char* kKind = "camera";

  /// Ray through a point of the image, in pixels: (0, 0) is the upper left corner of the image, (width,
  /// height) the lower right one; a pixel's centre lies at + 0.5.
  virtual Ray ray(const Vec2d& pixel, const Vec2i& size) const = 0;

  /// A beam that holds the rays through all points of a rectangle of the image; none where that is not known.
  virtual std::optional<Beam> beam(const Vec2d& /*lo*/, const Vec2d& /*hi*/, const Vec2i& /*size*/) const {
    return std::nullopt;
  }

  /// World to camera space (x right, y up, looking along -z) as a row-vector matrix, for image headers.
  virtual Imath::M44d camera_from_world() const = 0;

  /// World to normalised device coordinates (-1 .. 1, y up) as a row-vector matrix, for image headers.
  virtual Imath::M44d screen_from_world(const Vec2i& size) const = 0;
};

}  // namespace pileus
