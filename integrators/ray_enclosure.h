#pragma once

#include <vector>

#include "integrators/enclosed_world.h"
#include "integrators/fog_light.h"
#include "integrators/ray_fog.h"
#include "integrators/ray_profile.h"
#include "integrators/veiled_part.h"

namespace pileus {

/// Upper bound of |estimate - exact| in every channel.
double error_bound(const EnclosedRgb& exact, const Rgb& estimate);

/// An interval, per channel, that is proven to hold the exact radiance of a ray. Knows nothing of how anybody
/// else computes that radiance. Keeps its memory between rays.
///
/// The ray is cut into stretches of at most a cell, or as long as a haze is alone. Optical depth towards the
/// camera is exact. The light's is exact too at the ends of parts of a stretch, and within a proven distance
/// of linear between them; the integral over a part is then a closed form or a Gauss rule plus remainders,
/// which fall with the square of the part's length at least. Stretches that matter most are looked at first
/// and divided most (docs/error_bound.md).
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

  /// At most a cell of every grid in it, and of those that may shade a haze in it.
  struct Stretch {
    size_t span;
    double t0, t1, tau0;
    int end0 = kUnknown, end1 = kUnknown;
    bool is_joined = false;  ///< begins where the one before ends
    bool is_in_haze_alone = false;
    std::vector<Shade> shades;      ///< [light]
    std::vector<double> variation;  ///< [light] of d(depth)/ds along the stretch
    std::vector<Part> parts;        ///< none before anything is known about light
    EnclosedRgb radiance;
    Rgb settled{0.0};  ///< of its width: that of the parts
  };

  Goal goal_on_ray(Goal goal) const;
  std::vector<double> cuts(Segment segment) const;
  void narrow(const Rgb& estimate, const Goal& goal);
  void set_weights(const Vec3d& wo);
  void cut_stretches();
  void add_stretches(size_t span, bool is_joined);
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
  std::vector<EnclosedWorld::Zone> m_zones;
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
