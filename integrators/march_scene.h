#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "integrators/kernels/march_kernel.h"
#include "lib/scene/effect_plan.h"
#include "lib/scene/world.h"
#include "lib/volume/brick_mip.h"

namespace pileus {

/// A world of grids lit by suns in the form that the march kernels read, and what turns their sums back into
/// colours.
class MarchWorld {
 public:
  MarchWorld(const World& world, const EffectPlan& plan);

  /// Why a world cannot be marched; "" where it can.
  static std::string obstacle(const World& world, const EffectPlan& plan);

  MarchScene kernel;  ///< grids, lights and terms; lattices are filled by whoever decides on them

  /// A grid at one of its levels: 0 are the voxels as they are, each further one has voxels twice the size.
  struct GridLevel {
    int level = 0;
    std::unique_ptr<BrickGrid> coarse;  ///< null at level 0
    std::unique_ptr<BrickPyramid> pyramid;
  };

  /// The level above the present one; none where that is not worth its memory.
  std::optional<GridLevel> coarser_level(size_t grid) const;

  /// Marches a grid at another level from now on; returns the one before.
  GridLevel exchange_level(size_t grid, GridLevel next);

  int level(size_t grid) const { return m_levels[grid].level; }

  const std::vector<Illumination>& suns() const { return m_suns; }

  /// True where all rays have the same phase weights.
  bool is_isotropic() const { return m_is_isotropic; }

  /// Phase weights of a ray, [grid][light][kMostTerms], times the light's strongest channel.
  void weights_for(const Vec3d& direction, std::vector<float>& weights) const;

  /// Upper bound of the radiance that the media scatter or glow with along a ray of these weights, largest
  /// channel.
  double brightest(const float* weights) const;

  /// The kernel's height at t along a ray, as the two coefficients that it wants.
  void set_height(const Ray& ray, MarchRay& job) const;

  /// Radiance of the sums of one ray.
  Rgb radiance(const double* sums) const;

  /// Optical depth of all media from a point towards a light, exactly.
  double exact_depth(size_t light, const Vec3d& p_world, FieldCounters& counters) const;

 private:
  void add_grid(const WorldMedium& medium);
  void place_grid(size_t grid);
  void add_suns();
  void add_glow(const WorldMedium& medium, MarchGrid& grid) const;

  const World& m_world;
  std::vector<GridLevel> m_levels;
  std::vector<Illumination> m_suns;
  std::vector<double> m_strengths;  ///< [grid][light]: strongest channel of albedo * irradiance
  std::vector<Rgb> m_colours;       ///< the same, divided by that channel
  double m_base_height = 0.0;       ///< heights are counted from here [m]
  bool m_is_isotropic = true;
};

}  // namespace pileus
