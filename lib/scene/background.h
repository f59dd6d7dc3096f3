#pragma once

#include <optional>

#include "lib/core/registry.h"
#include "lib/math/vec.h"

namespace pileus {

/// What a ray sees that meets nothing.
struct Background : Plugin {
  static constexpr const char* kKind = "background";

  /// Radiance arriving from the unit direction d [W/(m2 sr)].
  virtual Rgb radiance(const Vec3d& d) const = 0;

  /// The radiance where it is the same from everywhere.
  virtual std::optional<Rgb> uniform() const { return std::nullopt; }

  /// Irradiance by all of it on a surface of unit normal n [W/m2]: the integral of radiance(d) max(0, n.d).
  virtual Rgb irradiance(const Vec3d& n) const = 0;
};

}  // namespace pileus
