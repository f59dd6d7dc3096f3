#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "lib/cloud/cloud_body.h"
#include "lib/cloud/cloud_formula.h"
#include "lib/cloud/cloud_noise.h"
#include "lib/cloud/cloud_recipe.h"
#include "lib/cloud/cloud_shape.h"
#include "lib/cloud/picture_map.h"
#include "lib/cloud/profile.h"
#include "lib/math/interval.h"
#include "lib/math/vec.h"

namespace pileus {

/// A cloud as a pure function of space: rho(p) by CloudFormula from
///   f        the free form at the point that CloudShape makes of p
///   factors  height_profile at the relative height, times the coverage map
///   n, d     the noises of the recipe (CloudNoise)
/// times density_profile, texture and density map. rho is 0 outside the shape and on its surface, and at most
/// 1; it is continuous unless the falloff is hard. (Combined 2019, "clouds"; Amorphous 2015, "Texture".)
/// threads: const, safe from many threads
class ProceduralCloud {
 public:
  /// A factor by the place, averaged over so many metres across.
  using DensityMap = std::function<double(const Vec3d& p_world, double width)>;

  /// The recipe has passed its checks; the free form, or mesh, has finite bounds.
  ///   map: a further factor, 0 .. 1, safe from many threads; or none
  /// errors: as PictureMap, where the recipe names pictures
  ProceduralCloud(const CloudRecipe& recipe, const CloudBody& form, DensityMap map = {});

  /// rho at a point of world space [1], 0 <= rho <= 1; 0 where a coordinate is not finite.
  ///   width: of what the density map is averaged over, for voxels [m]
  double density(const Vec3d& p_world, double width = 0.0) const;

  /// Bounds of the density in a box, for densities in single precision (CloudRegion) too.
  Interval range(const Box3d& box_world) const;

  /// True only where the density is 0 in the whole box: certain, but not complete.
  bool is_empty(const Box3d& box_world) const { return range(box_world).hi == 0; }

  /// World-space box that holds every point with rho > 0 [m].
  const Box3d& bounds() const { return m_shape.bounds(); }

  const CloudRecipe& recipe() const { return m_recipe; }
  const CloudShape& shape() const { return m_shape; }
  const PictureMap* texture() const { return m_texture.get(); }

  /// Of the coarsest noise [1/m].
  double noise_frequency() const;

 private:
  friend class CloudRegion;

  double frayed(double coverage, const Vec3d& p_world) const;

  CloudRecipe m_recipe;
  CloudShape m_shape;
  CloudFormula m_formula;
  Profile m_height_profile, m_density_profile;
  CloudNoise m_noise;
  std::optional<CloudNoise> m_detail;
  std::shared_ptr<const PictureMap> m_coverage_map, m_texture;
  DensityMap m_density_map;
};

}  // namespace pileus
