#pragma once

#include <memory>
#include <string>

#include "integrators/fog_corners.h"
#include "lib/fog/fog_on_ray.h"
#include "lib/scene/fading_fog.h"
#include "lib/scene/world.h"

namespace pileus {

/// The fog of a world made ready for a picture.
struct FogSetup {
  /// tolerance: absolute, of the picture; where fogs overlap, their light errs by a thousandth of that
  FogSetup(const World& all, double tolerance, const Vec2i& picture);

  const World& world;
  double accuracy;
  const Fading* alone = nullptr;              ///< the only fog, where it fades by distance
  std::unique_ptr<const FogCorners> corners;  ///< where it is interpolated over the picture

  /// How it is evaluated, for people; "" where it is by its own law at every point.
  std::string choice() const;
};

/// The fog along one ray; keeps its memory between rays.
class RayFog {
 public:
  explicit RayFog(const FogSetup& setup) : m_setup(setup) {}

  /// Nothing behind t_end is asked for afterwards.
  void build(const Ray& ray, double t_end, bool is_from_camera);

  /// What the fog makes of light from t.
  Veil to(double t) const { return m_setup.alone ? veil(m_setup.alone->shown(distance(t))) : m_fog.to(t); }

  /// What it makes of light from t_end, where the ray ends.
  Veil end() const {
    return m_setup.corners && m_is_from_camera ? veil(m_setup.corners->shown(m_ray)) : to(m_end);
  }

  /// Optical depth of the fog in front of t.
  double tau_to(double t) const;

  /// Between t0 and t1, with no edge between them.
  FogRange between(double t0, double t1) const;

  /// FogOnRay::growth() and has_closed_form().
  LightGrowth growth(double t0, double t1) const;
  bool has_closed_form() const { return m_setup.alone || m_fog.has_closed_form(); }

  /// Where it is not smooth.
  std::vector<double> edges() const;

 private:
  double distance(double t) const {
    return m_setup.alone->distance(t, m_ray.d, m_setup.world.fogs.front().view.axis);
  }
  Veil veil(double shown) const { return {shown, (1.0 - shown) * m_setup.alone->colour}; }

  const FogSetup& m_setup;
  Ray m_ray;
  double m_end = 0.0;
  bool m_is_from_camera = true;
  FogOnRay m_fog;
};

}  // namespace pileus
