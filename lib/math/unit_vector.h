#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "lib/math/vec.h"

namespace pileus {

/// v / |v| for every finite v but zero, also where the square of a component over- or underflows; nothing for
/// zero and where a component is not finite.
inline std::optional<Vec3d> unit_vector(const Vec3d& v) {
  if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) return std::nullopt;
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (largest == 0.0) return std::nullopt;
  const int exponent = std::ilogb(largest);
  const Vec3d scaled(std::scalbn(v.x, -exponent), std::scalbn(v.y, -exponent), std::scalbn(v.z, -exponent));
  return scaled / std::sqrt(dot(scaled, scaled));
}

}  // namespace pileus
