#pragma once

#include <memory>
#include <vector>

#include "integrators/fog_light.h"
#include "integrators/march_scene.h"
#include "integrators/media_shades.h"
#include "integrators/ray_fog.h"
#include "integrators/ray_profile.h"
#include "integrators/veiled_part.h"
#include "lib/volume/curvature_grid.h"

namespace pileus {

/// What enclosures of a world's rays need: how much each of its grids bends.
class EnclosedWorld {
 public:
  /// `march` fits `world`, which has grids and suns only; all outlive this. Uses parallel_for.
  EnclosedWorld(const World& world, const EffectPlan& plan, const MarchWorld& march);

  const World& world() const { return m_world; }
  const MarchWorld& march() const { return m_march; }
  const EffectPlan& plan() const { return m_plan; }
  const MediaShades& shades() const { return m_shades; }

  /// Upper bound of the total variation of d(tau)/ds, where tau(s) is the optical depth from
  /// middle + s * step towards a light, s in [-1/2, 1/2]. World space.
  double depth_variation(size_t light, const Vec3d& middle, const Vec3d& step) const;

  size_t memory_bytes() const;

 private:
  const World& m_world;
  const EffectPlan& m_plan;
  const MarchWorld& m_march;
  MediaShades m_shades;
  std::vector<std::shared_ptr<const BrickPyramid>> m_pyramids;  ///< of the voxels as they are, in floats
  std::vector<std::unique_ptr<CurvatureGrid>> m_curvatures;     ///< null where nothing is dimmed
};

/// Upper bound of |estimate - exact| in every channel.
double error_bound(const EnclosedRgb& exact, const Rgb& estimate);

/// An interval, per channel, that is proven to hold the exact radiance of a ray. Knows nothing of how anybody
/// else computes that radiance. Keeps its memory between rays.
///
/// The ray is cut into stretches of at most a cell. Optical depth towards the camera is exact. The light's is
/// exact too at the ends of parts of a stretch, and within a proven distance of linear between them; the
/// integral over a part is then a closed form or a Gauss rule plus remainders, which fall with the square of
/// the part's length at least. Stretches that matter most are looked at first and divided most
/// (docs/error_bound.md).
class RayEnclosure {
 public:
  explicit RayEnclosure(const EnclosedWorld& enclosed);

  /// When an interval is narrow enough.
  struct Goal {
    double half_width = 0.0;     ///< absolutely, in the widest channel
    double share = 0.25;         ///< or relative to the estimate's distance from its middle
    size_t most_lookups = 4000;  ///< of exact depths, at which it must do in any case
  };

  /// The radiance of a ray.
  ///   behind: radiance that arrives from the end of the segment
  ///   estimate: what the interval will be compared with
  ///   fog: along the ray, and already in front of `behind` as RayFog::end() says; null: none
  EnclosedRgb enclose(const Ray& ray, Segment segment, const EnclosedRgb& behind, const Rgb& estimate,
                      const Goal& goal, const RayFog* fog = nullptr);

  FieldCounters counters;      ///< of exact depths
  uint64_t depth_lookups = 0;  ///< exact depths, and bounds of their variation

 private:
  static constexpr int kUnknown = -1;

  /// A part of a stretch, with the exact depths at its ends.
  struct Part {
    double t0, t1, tau0;
    int end0, end1;     ///< of m_depths
    size_t slopes;      ///< of m_slopes
    EnclosedRgb rough;  ///< whatever the variation of depths does between the ends
    EnclosedRgb fine;   ///< for depths that are linear; slopes * variation comes on top
    Rgb settled{0.0};   ///< of its width, what stays however often it is divided
    bool is_rough = false;
    double width = 0.0;  ///< the rest of it, in the widest channel
  };

  /// At most a cell of every medium in it.
  struct Stretch {
    size_t span;
    double t0, t1, tau0;
    int end0 = kUnknown, end1 = kUnknown;
    bool is_joined = false;         ///< begins where the one before ends
    std::vector<Shade> shades;      ///< [light]
    std::vector<double> variation;  ///< [light] of d(depth)/ds along the stretch
    std::vector<Part> parts;        ///< none before anything is known about light
    EnclosedRgb radiance;
    Rgb settled{0.0};  ///< of its width: that of the parts
  };

  std::vector<double> fog_edges(Segment segment) const;
  void narrow(const Rgb& estimate, const Goal& goal);
  void set_weights(const Vec3d& wo);
  void cut_stretches(const Ray& ray);
  void add_stretches(const Ray& ray, size_t span, bool is_joined);
  void load_part(size_t span, double t0, double t1, double tau0);
  EnclosedRgb unlit(double t0, double t1) const;
  EnclosedRgb any_light(const std::vector<Shade>& shades) const;
  Shade shade_between(size_t light, double t0, double t1) const;
  void refine(Stretch& stretch, size_t index);
  void look_at_light(Stretch& stretch, size_t index);
  void divide_parts(Stretch& stretch);
  Part make_part(const Stretch& stretch, double t0, double t1, int end0, int end1);
  void enclose_light(const Stretch& stretch, Part& part);
  void sum_up(Stretch& stretch) const;
  int depths_at(double t);
  double position_error(double t) const;
  double rounding(const Rgb& behind, double distance) const;
  double column_of(size_t m) const;

  const Rgb& weight(size_t m, size_t l, size_t k) const {
    return m_weights[(m * m_lights + l) * m_terms + k];
  }

  const EnclosedWorld& m_enclosed;
  const World& m_world;
  size_t m_lights, m_terms = 1;
  Ray m_ray;
  const RayFog* m_fog = nullptr;  ///< along the ray; null: none
  FogLight m_fog_light;
  Rgb m_brightest_fog;  ///< that has been met, in front of a stretch
  RayProfile m_profile;
  VeiledPart m_part;
  std::vector<double> m_extinction;    ///< of each medium
  std::vector<DensityPiece> m_pieces;  ///< of each medium, of the part at hand
  std::vector<Rgb> m_weights;          ///< [medium][light][term]: radiance per optical depth of the medium
  std::vector<Rgb> m_darkest, m_brightest;  ///< [medium][light]: range of what it scatters
  double m_steepest = 0.0;                  ///< most that it changes per optical depth, of all media
  std::vector<Stretch> m_stretches;
  std::vector<double> m_depths;  ///< [end][light]
  std::vector<Rgb> m_slopes;     ///< [part][light]
};

}  // namespace pileus
