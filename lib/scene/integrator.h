#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "lib/core/registry.h"
#include "lib/math/ray.h"
#include "lib/math/vec.h"

namespace pileus {

struct World;
struct EffectPlan;

/// What one camera ray brings home.
struct RayResult {
  Rgb radiance{0.0, 0.0, 0.0};  ///< gathered along the ray, plus the end of the ray through what is left
  double transmittance = 1.0;   ///< share of what lies behind everything that still shows; alpha = 1 - this
  double z_first = std::numeric_limits<double>::infinity();  ///< [m] along the ray: first medium or surface
  double z_half =
      std::numeric_limits<double>::infinity();  ///< [m] where the transmittance falls below one half
  double error = std::numeric_limits<double>::quiet_NaN();  ///< own estimate for `radiance`; NaN: none
  double bound =
      std::numeric_limits<double>::quiet_NaN();  ///< proven: no channel of `radiance` errs by more; NaN: none
  uint64_t samples = 0;                          ///< density look-ups along the ray and its shadow rays
};

/// Work done, by name, for the render report. One per tile, summed at the end.
using Counters = std::map<std::string, uint64_t>;

/// How accurate a render shall be.
struct Accuracy {
  double tolerance = 0.0;   ///< absolute error per channel of linear radiance; 0: as exact as can be
  double coarseness = 1.0;  ///< >= 1: multiplies what trades accuracy for time (tolerance, step length)
  Vec2i picture{0, 0};   ///< size of the whole picture [pixels]: some of its rays may be looked at beforehand
  int most_bounces = 8;  ///< how often a ray is followed on by mirrors and glass
};

/// An integrator made ready for one world. Immutable: trace() is called from many threads at once.
class Tracer {
 public:
  virtual ~Tracer() = default;

  /// How many rays trace() likes to get at once. An interruption is heard between calls: where rays are
  /// costly, few.
  virtual size_t rays_per_call() const { return 4; }

  /// What was chosen for this scene and why, in sentences for people.
  virtual std::vector<std::string> choices() const { return {}; }

  /// True where rays are traced in step in packets of sixteen: a result may then depend on the other rays of
  /// its packet. trace() gets all pixels of each square of 4 x 4 in a row, so that packets are the same in
  /// every part of the picture that is rendered.
  virtual bool traces_packets() const { return false; }

  /// The result of every ray of a beam from the camera where all of them are known to see the same, without
  /// tracing any: a background of one colour, alone.
  virtual std::optional<RayResult> seen_alike(const Beam& /*beam*/) const { return std::nullopt; }

  /// Fills results[i] for rays[i], which are neighbours in Morton order. The result of a ray does not depend
  /// on the rays beside it, except in packets.
  virtual void trace(std::span<const Ray> rays, std::span<RayResult> results, Counters& counters) const = 0;
};

/// What happens along a ray. Gets bundles of rays, so that packets and scalar loops fit behind the same door.
struct Integrator : Plugin {
  static constexpr const char* kKind = "integrator";

  /// Chooses its kernels by the plan and derives what it needs. `world` and `plan` outlive the tracer.
  virtual std::unique_ptr<const Tracer> prepare(const World& world, const EffectPlan& plan,
                                                const Accuracy& accuracy) const = 0;

  /// True where it may read grids at coarser levels than they have, if the picture shows no difference.
  virtual bool has_level_of_detail() const { return false; }
};

}  // namespace pileus
