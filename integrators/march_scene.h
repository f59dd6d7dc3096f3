#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "integrators/kernels/march_kernel.h"
#include "lib/scene/effect_plan.h"
#include "lib/scene/world.h"
#include "lib/volume/brick_mip.h"

namespace pileus {

/// How the values of the grids are stored: in 16 bits, where these err by less than an error that is
/// allowed in the picture; or always, or never.
struct MarchStorage {
  enum class Kind { by_error, floats, quantized };
  Kind kind = Kind::by_error;
  double allowed = 0.0;
  std::string why_floats = "asked for";
};

/// What lamps may bring about along a ray, at most.
struct LampLight {
  double brightest = 0.0;  ///< that a medium scatters towards the viewer [W/(m2 sr)]
  double rounding = 0.0;   ///< what single precision changes of the ray's radiance, estimated
};

/// A world of media lit by suns and lamps in the form that the march kernels read, and what turns their sums
/// back into colours. Media are numbered as in MarchScene.
class MarchWorld {
 public:
  MarchWorld(const World& world, const EffectPlan& plan, const MarchStorage& storage = {});

  /// What 16-bit values change in a pixel where no light on the ray is brighter than this, estimated.
  double storage_error(double brightest) const {
    return m_storage_depth_error * brightest + m_storage_glow_error;
  }

  /// The same where the picture is as bright as scattering makes it.
  double storage_error_in_view() const { return m_storage_error_in_view; }

  /// One line per grid: how its values are stored, and why.
  const std::vector<std::string>& storage_choices() const { return m_storage_choices; }

  /// Why a world cannot be marched; "" where it can.
  static std::string obstacle(const World& world, const EffectPlan& plan);

  /// All media, by their numbers.
  std::span<const WorldMedium* const> media() const { return m_media; }

  /// The analytic media, by their numbers less those of the grids.
  std::span<const WorldMedium* const> hazes() const {
    return std::span(m_media).subspan(kernel.grids.size());
  }

  MarchScene kernel;  ///< media, lights and terms; lattices are filled by whoever decides on them

  /// A grid at one of its levels: 0 are the voxels as they are, each further one has voxels twice the size.
  struct GridLevel {
    int level = 0;
    std::unique_ptr<BrickGrid> coarse;  ///< null at level 0
    std::shared_ptr<const BrickPyramid> pyramid;
  };

  /// False where grids are read as they are, whatever a pixel shows.
  bool has_levels() const { return kernel.hazes.empty() && kernel.places.empty(); }

  /// The level above the present one; none where that is not worth its memory.
  std::optional<GridLevel> coarser_level(size_t grid) const;

  /// Marches a grid at another level from now on; returns the one before.
  GridLevel exchange_level(size_t grid, GridLevel next);

  int level(size_t grid) const { return m_levels[grid].level; }

  /// All lights; of lamps they mean nothing.
  const std::vector<Illumination>& suns() const { return m_suns; }

  bool has_lamps() const { return !kernel.lamps.empty(); }

  /// A light seen from a point.
  Illumination light_at(size_t light, const Vec3d& p_world) const {
    return m_world.lights[light]->at(p_world);
  }

  /// True where all rays have the same phase weights.
  bool is_isotropic() const { return m_is_isotropic; }

  /// Phase weights of a ray, [medium][light][kMostTerms], times the light's strongest channel; 0 for lamps.
  void weights_for(const Vec3d& direction, std::vector<float>& weights) const;

  /// Sets those of lamps, as they are at a point.
  void set_lamp_weights(const Vec3d& direction, const Vec3d& p_world, std::vector<float>& weights) const;

  LampLight lamplight(const Ray& ray, const Segment& segment) const;

  /// Upper bound of the radiance that the media scatter or glow with along a ray of these weights, largest
  /// channel.
  double brightest(const float* weights) const;

  /// The part of it that comes from suns, in full light.
  double sunlit(const float* weights) const;

  /// The kernel's height at t along a ray, as the two coefficients that it wants.
  void set_height(const Ray& ray, MarchRay& job) const;

  /// The strongest channels of what all lights make of one ray, added up.
  double light(const double* sums) const;

  /// Radiance of the sums of one ray.
  Rgb radiance(const double* sums) const;

  /// Optical depth of all grids from a point towards a light, exactly.
  double exact_depth(size_t light, const Vec3d& p_world, FieldCounters& counters) const;

 private:
  double sunlit(size_t medium, const float* weights) const;
  double worst_phase_error() const;
  void add_medium(const WorldMedium& medium, MarchMedium& kernel_medium);
  void add_grid(const WorldMedium& medium, const MarchStorage& storage);
  double brightness_in_view(const WorldMedium& medium) const;
  std::shared_ptr<const BrickPyramid> stored_values(const WorldMedium& medium, const MarchStorage& storage);
  void place_grid(size_t grid);
  std::vector<Affine> local_places(size_t grid) const;
  void add_lights();
  void add_lamp(size_t light);
  void add_glow(const WorldMedium& medium, MarchMedium& of) const;

  const World& m_world;
  std::vector<const WorldMedium*> m_media;  ///< grids, then hazes
  std::vector<GridLevel> m_levels;
  std::vector<Illumination> m_suns;
  std::vector<double>
      m_strengths;             ///< [medium][light]: strongest channel of albedo * irradiance, or intensity
  std::vector<Rgb> m_colours;  ///< the same, divided by that channel
  double m_densest = 0.0;      ///< extinction of all media, at most [1/m]
  double m_base_height = 0.0;  ///< heights are counted from here [m]
  bool m_is_isotropic = true;
  double m_storage_depth_error = 0.0;  ///< what 16-bit values change of optical depths that show
  double m_storage_error_in_view = 0.0;
  double m_storage_glow_error = 0.0;  ///< and of emitted radiance
  std::vector<std::string> m_storage_choices;
};

}  // namespace pileus
