#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
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

/// What is known of a ray that need not be found out, or that need not be seen.
struct RaySight {
  double clear = 0.0;     ///< [m] the ray meets nothing of the shape before this t
  double width = 0.0;     ///< [m] of a pixel at t = 0; with `widening` 0: every detail counts
  double widening = 0.0;  ///< of a pixel per metre

  double width_at(double t) const { return width + t * widening; }
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

  /// The same for a ray of which something is known. `clear` does not change the answer; details far smaller
  /// than a pixel may be left out, where a form says so.
  virtual std::optional<SurfaceHit> intersect_seen(const Ray& ray, Segment segment, const RaySight&) const {
    return intersect(ray, segment);
  }

  /// intersect_seen() of neighbouring rays, together where a form can do that for less.
  virtual void intersect_all(std::span<const Ray> rays, std::span<const Segment> segments,
                             std::span<const RaySight> seen,
                             std::span<std::optional<SurfaceHit>> hits) const {
    for (size_t i = 0; i < rays.size(); ++i) hits[i] = intersect_seen(rays[i], segments[i], seen[i]);
  }

  /// Sets `met` of the rays that meet the shape in their segments; those that have it set are not asked.
  virtual void find_met(std::span<const Ray> rays, std::span<const Segment> segments,
                        std::span<const RaySight> seen, std::span<char> met) const {
    for (size_t i = 0; i < rays.size(); ++i) {
      if (!met[i]) met[i] = intersect_seen(rays[i], segments[i], seen[i]).has_value();
    }
  }

  /// A distance before which none of the rays, which are neighbours, meets the shape [m]; infinite where none
  /// meets it at all. Holds for all rays between them, too: means of theirs. Asked once for many rays: worth
  /// more than it costs where a form has it cheaply.
  ///   seen: of each of them
  virtual double clear_distance(std::span<const Ray> rays, const RaySight& seen) const {
    (void)rays, (void)seen;
    return 0.0;
  }

  /// True where clear_distance() tells anything.
  virtual bool knows_clear_distance() const { return false; }

  /// Appends every t at which the ray may cross the edge of the shadow that this shape casts from the light:
  /// the in-scattered light jumps there, and a quadrature that knows where need not search. Unless
  /// knows_shadow_edges(), there may be more of them than are told.
  virtual void append_shadow_edges(const Ray& ray, const Light& light, std::vector<double>& t) const {
    (void)ray, (void)light, (void)t;
  }

  /// True where append_shadow_edges() tells all of them, and in closed form.
  virtual bool knows_shadow_edges() const { return false; }

  /// Appends stretches of a ray's segment, in any order: outside of them, the shape surely stands between no
  /// point of the segment and a sun. By default one, as the bounds tell.
  ///   towards_sun: unit vector
  virtual void append_shadowable(const Ray& ray, Segment segment, const Vec3d& towards_sun,
                                 std::vector<Segment>& stretches) const;

  /// False where all light passes: what is transparent throws no shadow.
  bool casts_shadow() const { return !shader || !shader->is_transparent(); }

  /// True where some light passes on its way from lamps, and light_through() tells how much.
  bool has_holes() const { return shader && casts_shadow() && shader->has_holes(); }

  /// Share of the light of a ray that the surface lets through where the ray crosses it in the segment, by
  /// the opacity of its textures; each crossing counts. Counts them, too.
  ///   seen: pixels are as wide as textures are averaged over
  double light_through(Ray ray, Segment segment, const RaySight& seen, uint64_t& crossings) const;

  /// World-space box [m]; may be infinite.
  virtual Box3d bounds() const = 0;

  /// False where the shape surely stands between no point of a box and a sun; by default as its bounds tell.
  ///   towards_sun: unit vector
  virtual bool may_shadow(const Box3d& box, const Vec3d& towards_sun) const;
};

}  // namespace pileus
