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
#include "lib/core/param_table.h"
#include "lib/math/offset_point.h"
#include "lib/math/roots.h"
#include "lib/scene/shape.h"

namespace pileus {
namespace {

struct Sphere final : Shape {
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
    const Vec3d n = dot(outwards, ray.d) > 0.0 ? -outwards : outwards;
    return SurfaceHit{*t, n, surface_error(length(ray.o) + length(f) + m_radius)};
  }
  Box3d bounds() const override {
    const Vec3d half(m_radius, m_radius, m_radius);
    return {m_center - half, m_center + half};
  }
};

}  // namespace

PILEUS_PLUGIN(Shape, sphere, Sphere, "a sphere")

}  // namespace pileus
