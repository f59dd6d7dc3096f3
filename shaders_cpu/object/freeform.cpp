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
#include "lib/math/box_shadow.h"
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
  std::vector<Box3d> m_part_bounds;

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
    built->m_part_bounds = built->m_tracer->part_bounds();
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
  void append_shadow_edges(const Ray& ray, const Light& light, std::vector<double>& t) const override {
    constexpr int kLooks = 64, kHalvings = 48;
    const Segment stretch = stretch_in_shadow_of_bounds(ray, light);
    if (stretch.empty()) return;
    std::vector<double> looks;
    for (int look = 0; look <= kLooks; ++look)
      looks.push_back(stretch.t0 + double(look) / kLooks * stretch.length());
    const std::vector<char> shadowed = are_shadowed(ray, looks, light);
    std::vector<Edge> edges;
    for (size_t i = 1; i < looks.size(); ++i) {
      if (shadowed[i] != shadowed[i - 1]) edges.push_back({looks[i - 1], looks[i], shadowed[i - 1]});
    }
    for (int n = 0; n < kHalvings && !edges.empty(); ++n) halve(ray, light, edges);
    for (const Edge& edge : edges) t.push_back(edge.middle());
  }

  void append_shadowable(const Ray& ray, Segment segment, const Vec3d& towards_sun,
                         std::vector<Segment>& stretches) const override {
    const Segment of_all = shadow_of_box(ray, segment, towards_sun, bounds());
    if (of_all.empty()) return;
    for (const Box3d& part : m_part_bounds)
      stretches.push_back(shadow_of_box(ray, segment, towards_sun, part));
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

  /// The edge of a shadow between two t of a ray.
  struct Edge {
    double before, after;
    char shadowed_before;
    double middle() const { return 0.5 * (before + after); }
  };

  void halve(const Ray& ray, const Light& light, std::vector<Edge>& edges) const {
    std::vector<double> middles;
    for (const Edge& edge : edges) middles.push_back(edge.middle());
    const std::vector<char> shadowed = are_shadowed(ray, middles, light);
    for (size_t i = 0; i < edges.size(); ++i)
      (shadowed[i] == edges[i].shadowed_before ? edges[i].before : edges[i].after) = middles[i];
  }

  /// Of points of a ray, together.
  std::vector<char> are_shadowed(const Ray& ray, std::span<const double> t, const Light& light) const {
    std::vector<Ray> to_light;
    std::vector<Segment> segments;
    for (const double at : t) {
      const Vec3d p = ray.at(at);
      const Illumination here = light.at(p);
      to_light.push_back({p, here.wi});
      segments.push_back({0.0, light.is_directional() ? kInfinity : here.distance});
    }
    std::vector<char> met(t.size(), 0);
    m_tracer->find_met(to_light, segments, met);
    return met;
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
