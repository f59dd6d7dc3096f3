#pragma once

#include "lib/cloud/cloud_recipe.h"
#include "lib/freeform/free_form.h"
#include "lib/math/vec.h"
#include "lib/noise/fbm.h"

namespace pileus {

/// A cloud as a pure function of space. With f the free form, h the relative height in its bounds and b the
/// billows of the noise (lib/noise/fbm.h):
///   depth    = 1 - sqrt(1 - f)                     0 on the surface, 1 in the centre of an ellipsoid
///   coverage = smoothstep(depth / edge) * height_profile(h)
///   carved   = coverage - erosion * (1 - b)²       the noise moves the boundary instead of fading it
///   rho      = min(1, sharpness * max(0, (carved - threshold) / (1 - threshold)))
/// rho is continuous, 0 outside the free form and on its surface, and at most 1. (METHODS §9.1 for the
/// remap.) threads: const, safe from many threads
class ProceduralCloud {
 public:
  /// The recipe has passed its checks; the free form has finite bounds.
  ProceduralCloud(const CloudRecipe& recipe, const FreeForm& form);

  /// rho at a point of world space [1], 0 <= rho <= 1; 0 where a coordinate is not finite.
  double density(const Vec3d& p_world) const;

  /// True only where the density is 0 in the whole box: certain, but not complete.
  bool is_empty(const Box3d& box_world) const;

  /// World-space box that holds every point with rho > 0 [m].
  const Box3d& bounds() const { return m_bounds; }

 private:
  double height_factor(double y_world) const;
  double coverage(double f, double factor) const;
  double remapped(double carved) const;

  CloudRecipe m_recipe;
  FreeForm m_form;
  Box3d m_bounds;
  Fbm m_billows;
};

}  // namespace pileus
