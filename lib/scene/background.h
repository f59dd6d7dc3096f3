#pragma once

#include "lib/core/registry.h"
#include "lib/math/vec.h"

namespace pileus {

/// What a ray sees that meets nothing.
struct Background : Plugin {
  static constexpr const char* kKind = "background";

  /// Radiance arriving from the unit direction d [W/(m2 sr)].
  virtual Rgb radiance(const Vec3d& d) const = 0;
};

}  // namespace pileus
