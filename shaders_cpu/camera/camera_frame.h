#pragma once

#include <string>
#include <vector>

#include "lib/core/param_table.h"
#include "lib/math/vec.h"

namespace pileus {

/// Where a camera stands and how it is turned: what all cameras share.
struct CameraFrame {
  Vec3d position{0.0, 0.0, 5.0};
  Vec3d look_at{0.0, 0.0, 0.0};
  Vec3d up{0.0, 1.0, 0.0};

  // Set by commit(): orthonormal, right-handed.
  Vec3d right, true_up, backward;

  void describe(ParamTable& params);
  void commit(std::vector<std::string>& problems);

  /// World to camera space (x right, y up, looking along -z), row-vector.
  Imath::M44d camera_from_world() const;
};

/// A point of the image in pixels, (0, 0) upper left, as x, y on the image plane: x from -1 at the left edge
/// to 1 at the right one, y upwards in the same units.
inline Vec2d image_plane(const Vec2d& pixel, const Vec2i& size) {
  return Vec2d(2.0 * pixel.x - size.x, size.y - 2.0 * pixel.y) / double(size.x);
}

}  // namespace pileus
