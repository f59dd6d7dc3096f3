#pragma once

#include "lib/core/registry.h"
#include "lib/math/vec.h"

namespace pileus {

/// How a medium spreads the light it scatters. Normalised: the integral of p over all wi is 1.
struct PhaseFunction : Plugin {
  static constexpr const char* kKind = "phase";

  /// p(wo, wi) [1/sr]. Both unit vectors leave the point: wo towards the viewer, wi towards the light, so
  /// straight on (forward) is dot(wo, wi) = -1. Finite and >= 0 for every pair.
  virtual double p(const Vec3d& wo, const Vec3d& wi) const = 0;

  /// True where p is the same for all directions.
  virtual bool is_isotropic() const { return false; }
};

}  // namespace pileus
