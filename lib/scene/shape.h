#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lib/core/registry.h"
#include "lib/math/ray.h"
#include "lib/math/vec.h"
#include "lib/scene/light.h"
#include "lib/scene/surface_shader.h"

namespace pileus {

struct SurfaceHit {
  double t = 0.0;      ///< [m]
  Vec3d n;             ///< unit normal, on the side the ray comes from
  double error = 0.0;  ///< [m] bound on how far ray.at(t) lies from the surface; see lib/math/offset_point.h
  bool is_inside = false;  ///< the ray comes from inside the solid
};

/// A solid object: its form (the plugin) and what light does on it (the common part).
struct Shape : Plugin {
  static constexpr const char* kKind = "object";

  std::shared_ptr<const SurfaceShader> shader;
  bool hidden = false;  ///< not part of the world itself: other objects are made of it

  void describe(ParamTable& params) final;

  /// The shader where the scene names none; "": none.
  virtual std::string default_shader() const { return "phong"; }

  /// The parameters of the form.
  virtual void describe_form(ParamTable& params) = 0;

  /// Nearest hit with t in (segment.t0, segment.t1).
  virtual std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment) const = 0;

  /// Appends every t at which the ray may cross the edge of the shadow that this shape casts from the light:
  /// the in-scattered light jumps there, and a quadrature that knows where need not search. False where there
  /// may be more of them than were told.
  virtual bool append_shadow_edges(const Ray& ray, const Light& light, std::vector<double>& t) const {
    (void)ray, (void)light, (void)t;
    return false;
  }

  /// False where light passes: what is transparent throws no shadow.
  bool casts_shadow() const { return !shader || !shader->is_transparent(); }

  /// World-space box [m]; may be infinite.
  virtual Box3d bounds() const = 0;

  /// False where the shape surely stands between no point of a box and a sun; by default as its bounds tell.
  ///   towards_sun: unit vector
  virtual bool may_shadow(const Box3d& box, const Vec3d& towards_sun) const;
};

}  // namespace pileus
