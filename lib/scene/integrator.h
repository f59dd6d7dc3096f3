#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>

#include "lib/core/registry.h"
#include "lib/math/ray.h"
#include "lib/math/vec.h"

namespace pileus {

struct World;
struct EffectPlan;

/// What one camera ray brings home.
struct RayResult {
  Rgb radiance{0.0, 0.0, 0.0};  ///< premultiplied, background included only through its own opacity
  double transmittance = 1.0;   ///< share of what lies behind everything that still shows; alpha = 1 - this
  double z_first = std::numeric_limits<double>::infinity();  ///< [m] along the ray: first medium or surface
  double z_half =
      std::numeric_limits<double>::infinity();  ///< [m] where the transmittance falls below one half
  double error = 0.0;                           ///< the integrator's own estimate of the error of `radiance`
  uint64_t samples = 0;                         ///< density samples and shadow queries spent
};

/// Work done, by name, for the render report. One per tile, summed at the end.
using Counters = std::map<std::string, uint64_t>;

/// What happens along a ray. Gets whole tiles, so that packets and scalar loops fit behind the same door.
struct Integrator : Plugin {
  static constexpr const char* kKind = "integrator";

  /// Called once per render, before any trace(). `world` and `plan` outlive the calls.
  virtual void prepare(const World& world, const EffectPlan& plan, double tolerance) = 0;

  /// Fills results[i] for rays[i]: one square tile in Morton order. Called from many threads at once; the
  /// result of a ray does not depend on the rays beside it.
  virtual void trace(std::span<const Ray> rays, std::span<RayResult> results, Counters& counters) const = 0;

  /// Makes the next render coarser by `factor` (> 1) in whatever knob trades accuracy for time.
  virtual void coarsen(double factor) = 0;
};

}  // namespace pileus
