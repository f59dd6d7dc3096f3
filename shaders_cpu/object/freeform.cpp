/// A solid of free form: quadrics with bumps and dents, set operations, morphs, deformations.
///
///   form     name of a [freeform.NAME] section (docs/freeform.md); a solid with an end
///   method   newton: every crossing to rounding; subdivision: halving of the ray, for comparison
///   shader   what light does on the surface; default phong
///
///   [freeform.pebble]
///   base    = { ellipsoid = { radii = [1, 0.6, 0.8] } }
///   perturb = [ { sphere = { center = [0.7, 0.4, 0], radius = 0.6 }, factor = 0.8 } ]
///
///   [object.pebble]
///   type = "freeform"
///   form = "pebble"
///
/// Seen from inside as well as from outside. No crossing is missed that is deeper than rounding.
/// ref: METHODS 4, 5
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/core/param_table.h"
#include "lib/freeform/form_tracer.h"
#include "lib/math/offset_point.h"
#include "lib/math/roots.h"
#include "lib/scene/formed_shape.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool is_finite(const Box3d& box) {
  return std::isfinite(length(box.min)) && std::isfinite(length(box.max));
}

struct FreeFormObject final : FormedShape {
  std::string m_form, m_method = "newton";

  /// What build() adds.
  FreeForm m_solid;
  std::shared_ptr<const FormTracer> m_tracer;

  void describe_form(ParamTable& params) override {
    params.reference("form", m_form, "freeform", "the solid").required();
    params.text("method", m_method, "how rays find it: exactly, or as the documents halve them")
        .one_of({"newton", "subdivision"});
  }

  std::shared_ptr<const Shape> build(const ShapeSources& sources) const override {
    auto built = std::make_shared<FreeFormObject>(*this);
    built->m_solid = sources.freeforms.at(m_form);
    const Box3d& box = built->m_solid.bounds();
    if (!box.isEmpty() && !is_finite(box)) {
      throw Error(ErrorKind::scene, SourceLoc{},
                  fmt::format("free form \"{}\" has no end; expected one that has, such as its intersection "
                              "with an ellipsoid",
                              m_form));
    }
    const TraceMethod method = m_method == "newton" ? TraceMethod::newton : TraceMethod::subdivision;
    built->m_tracer = std::make_shared<const FormTracer>(built->m_solid, method);
    return built;
  }

  std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment) const override {
    const std::optional<double> t = m_tracer->first_crossing(ray, segment);
    if (!t) return std::nullopt;
    return hit_at(ray, *t);
  }

  void intersect_all(std::span<const Ray> rays, std::span<const Segment> segments, std::span<const RaySight>,
                     std::span<std::optional<SurfaceHit>> hits) const override {
    thread_local std::vector<double> t;
    t.resize(rays.size());
    m_tracer->first_crossings(rays, segments, t);
    for (size_t i = 0; i < rays.size(); ++i) {
      hits[i].reset();
      if (t[i] < kInfinity) hits[i] = hit_at(rays[i], t[i]);
    }
  }

  void find_met(std::span<const Ray> rays, std::span<const Segment> segments, std::span<const RaySight>,
                std::span<char> met) const override {
    m_tracer->find_met(rays, segments, met);
  }

  /// Where rays towards the light begin or cease to meet the solid: looked for at equal distances in the
  /// stretch that the shadow of the bounds covers, then halved. Narrower shadows may be missed.
  bool append_shadow_edges(const Ray& ray, const Light& light, std::vector<double>& t) const override {
    constexpr int kLooks = 64, kHalvings = 48;
    const Segment stretch = stretch_in_shadow_of_bounds(ray, light);
    if (stretch.empty()) return true;
    const auto at = [&](double share) { return stretch.t0 + share * stretch.length(); };
    bool was_shadowed = is_shadowed(ray.at(at(0.0)), light);
    for (int look = 1; look <= kLooks; ++look) {
      double before = double(look - 1) / kLooks, after = double(look) / kLooks;
      const bool shadowed = is_shadowed(ray.at(at(after)), light);
      if (shadowed != was_shadowed) {
        for (int n = 0; n < kHalvings; ++n) {
          const double middle = 0.5 * (before + after);
          (is_shadowed(ray.at(at(middle)), light) == was_shadowed ? before : after) = middle;
        }
        t.push_back(at(0.5 * (before + after)));
      }
      was_shadowed = shadowed;
    }
    return false;
  }

  Box3d bounds() const override { return m_solid.bounds(); }

 private:
  SurfaceHit hit_at(const Ray& ray, double t) const {
    const Vec3d p = ray.at(t);
    const FormAtPoint form = m_tracer->at(p);
    const double steepness = length(form.gradient);
    const double scale = length(ray.o) + std::fabs(t) + length(p);
    // On an edge where the form has no gradient the side of the ray is all that is known.
    if (!(steepness > 0.0) || !std::isfinite(steepness)) return SurfaceHit{t, -ray.d, surface_error(scale)};
    const bool is_inside = dot(form.gradient, ray.d) < 0.0;  // it leads inwards
    const Vec3d n = (is_inside ? 1.0 : -1.0) / steepness * form.gradient;
    // As far as the value is from 0, with its own rounding.
    const double error = surface_error(scale) + (std::fabs(form.value) + form.margin) / steepness;
    return SurfaceHit{t, n, error, is_inside};
  }

  bool is_shadowed(const Vec3d& p, const Light& light) const {
    const Illumination at = light.at(p);
    const double distance = light.is_directional() ? kInfinity : at.distance;
    return m_tracer->first_crossing({p, at.wi}, {0.0, distance}).has_value();
  }

  /// The part of a ray from which the direction to the light meets the ball around the bounds.
  Segment stretch_in_shadow_of_bounds(const Ray& ray, const Light& light) const {
    const Box3d& box = bounds();
    if (box.isEmpty()) return {};
    const Vec3d center = 0.5 * box.min + 0.5 * box.max;
    const double radius = 0.5 * length(box.max - box.min);
    const double nearest = std::max(0.0, dot(center - ray.o, ray.d));
    if (!light.is_directional()) {
      // A cone behind the ball; all of the ray within ten times the distance of ball and light.
      const Illumination at_eye = light.at(ray.o);
      return {0.0, nearest + 10 * (length(center - ray.o) + at_eye.distance + radius)};
    }
    const Vec3d wi = light.at(ray.o).wi, f = ray.o - center;
    const Vec3d f_across = f - dot(f, wi) * wi, d_across = ray.d - dot(ray.d, wi) * wi;
    const Roots<double> edges = quadratic_roots(d_across.length2(), 2.0 * dot(f_across, d_across),
                                                f_across.length2() - radius * radius);
    if (edges.count < 2) return {};
    return {std::max(0.0, edges.t[0]), edges.t[1]};
  }
};

}  // namespace

PILEUS_PLUGIN(Shape, freeform, FreeFormObject,
              "a solid of free form: quadrics with bumps, set operations, morphs")

}  // namespace pileus
