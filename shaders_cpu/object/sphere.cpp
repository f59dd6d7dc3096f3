/// A sphere.
///
///   center   [m]   default [0, 0, 0]
///   radius   [m]   > 0, default 1
///   shader   what light does on the surface; default phong
///
///   [object.ball]
///   type = "sphere"
///   center = [0, 1, 0]
///   radius = 0.5
///
/// Seen from inside as well as from outside. Hits are accurate for small spheres far away and for planets
/// underfoot alike. ref: METHODS 5.8
#include <algorithm>

#include "lib/core/param_table.h"
#include "lib/math/offset_point.h"
#include "lib/math/roots.h"
#include "lib/scene/known_shadow.h"
#include "lib/scene/shape.h"

namespace pileus {
namespace {

struct Sphere final : Shape, KnownShadow {
  Vec3d m_center{0.0, 0.0, 0.0};
  double m_radius = 1.0;

  void describe_form(ParamTable& params) override {
    params.vector("center", m_center, "m", "of the sphere");
    params.number("radius", m_radius, "m", "of the sphere").above(0);
  }
  std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment) const override {
    const Vec3d f = ray.o - m_center;
    const auto t = sphere_hits(f, ray.d, m_radius).first_in(segment.t0, segment.t1);
    if (!t) return std::nullopt;
    const Vec3d outwards = normalize(f + *t * ray.d);
    const bool is_inside = dot(outwards, ray.d) > 0.0;
    const double error = surface_error(length(ray.o) + length(f) + m_radius);
    return SurfaceHit{*t, is_inside ? -outwards : outwards, error, is_inside};
  }
  /// The shadow is a cylinder behind the sphere for a sun, a cone for a point light: a quadratic along the
  /// ray.
  void append_shadow_edges(const Ray& ray, const Light& light, std::vector<double>& t) const override {
    const Illumination at_eye = light.at(ray.o);
    const Roots<double> edges = light.is_directional() ? cylinder_edges(ray, at_eye.wi)
                                                       : cone_edges(ray, ray.o + at_eye.distance * at_eye.wi);
    t.insert(t.end(), edges.begin(), edges.end());
  }
  bool knows_shadow_edges() const override { return true; }
  /// The shadow is all that lies within the radius of the half line from the centre away from the sun. The
  /// distance from that is convex along a line, and changes no faster than the point moves.
  Shade shade_between(const Vec3d& p0, const Vec3d& p1, const Vec3d& wi, double off) const override {
    constexpr double kRounding = 1e-11;
    const double margin = off + kRounding * (length(p0) + length(p1) + length(m_center) + m_radius);
    const auto distance = [&](const Vec3d& p) {
      const Vec3d q = p - m_center;
      const double ahead = dot(q, wi);
      return ahead >= 0.0 ? length(q) : length(q - ahead * wi);
    };
    if (std::max(distance(p0), distance(p1)) < m_radius - margin) return Shade::all;
    const double nearest = distance(0.5 * (p0 + p1)) - 0.5 * length(p1 - p0);
    return nearest > m_radius + margin ? Shade::none : Shade::unknown;
  }
  Box3d bounds() const override {
    const Vec3d half(m_radius, m_radius, m_radius);
    return {m_center - half, m_center + half};
  }

 private:
  /// Where the distance to the line through the centre along wi is the radius.
  Roots<double> cylinder_edges(const Ray& ray, const Vec3d& wi) const {
    const Vec3d f = ray.o - m_center;
    const Vec3d f_across = f - dot(f, wi) * wi, d_across = ray.d - dot(ray.d, wi) * wi;
    return quadratic_roots(d_across.length2(), 2.0 * dot(f_across, d_across),
                           f_across.length2() - m_radius * m_radius);
  }

  /// Where the direction from the light touches the sphere: (v . q)^2 = (|q|^2 - r^2) |v|^2, with q from the
  /// light to the centre and v to the point on the ray.
  Roots<double> cone_edges(const Ray& ray, const Vec3d& p_light) const {
    const Vec3d q = m_center - p_light, v = ray.o - p_light;
    const double k = q.length2() - m_radius * m_radius;
    if (k <= 0.0) return {};  // the light is inside the sphere: nothing outside is lit
    const double dq = dot(ray.d, q), vq = dot(v, q);
    return quadratic_roots(dq * dq - k, 2.0 * (vq * dq - k * dot(v, ray.d)), vq * vq - k * v.length2());
  }
};

}  // namespace

PILEUS_PLUGIN(Shape, sphere, Sphere, "a sphere")

}  // namespace pileus
