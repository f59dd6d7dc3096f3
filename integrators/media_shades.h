#pragma once

#include <vector>

#include "lib/scene/effect_plan.h"
#include "lib/scene/known_shadow.h"
#include "lib/scene/world.h"

namespace pileus {

/// What is proven of the shadows that solids cast into the media of a world whose lights are suns.
class MediaShades {
 public:
  MediaShades(const World& world, const EffectPlan& plan);

  /// Of the points between p0 and p1, which lie in some medium and may be off by `off` [m]. `all` is told of
  /// spheres and planes without holes alone.
  Shade between(size_t light, const Vec3d& p0, const Vec3d& p1, double off) const;

  /// The share of a stretch below which it is not worth while to ask again about a part that is `unknown`.
  /// Stretches are a cell long at most, or as long as a haze.
  double finest(size_t light, bool is_in_haze_alone) const;

 private:
  std::vector<Vec3d> m_towards_suns;
  std::vector<std::vector<const Shape*>> m_casters;  ///< [light]: that may shade some medium
  std::vector<char> m_is_known;                      ///< [light]: so are the shadows of all of them
};

}  // namespace pileus
