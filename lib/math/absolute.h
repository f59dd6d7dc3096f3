#pragma once

#include <cmath>

#include "lib/math/vec.h"

namespace pileus {

/// Component by component.
inline Vec3d absolute(const Vec3d& v) {
  return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)};
}

}  // namespace pileus
