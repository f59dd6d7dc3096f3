/// An infinite plane, such as a ground.
///
///   point    any point of it                  [m]   default [0, 0, 0]
///   normal   of any length but 0              [1]   default [0, 1, 0]
///   shader   what light does on the surface; default phong
///
///   [object.ground]
///   type = "plane"
///   point = [0, -1, 0]
///   shader = { type = "phong", diffuse = [0.3, 0.3, 0.25] }
///
/// Has no thickness, and both sides are seen. For glass, the inside is the side that the normal leads away
/// from.
#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/core/param_table.h"
#include "lib/math/offset_point.h"
#include "lib/math/unit_vector.h"
#include "lib/scene/known_shadow.h"
#include "lib/scene/shape.h"

namespace pileus {
namespace {

struct Plane final : Shape, KnownShadow {
  Vec3d m_point{0.0, 0.0, 0.0};
  Vec3d m_normal{0.0, 1.0, 0.0};
  Vec3d m_n;

  void describe_form(ParamTable& params) override {
    params.vector("point", m_point, "m", "any point of the plane");
    params.vector("normal", m_normal, "", "of the plane; any length but 0");
  }
  void commit(std::vector<std::string>& problems) override {
    if (const auto n = unit_vector(m_normal)) {
      m_n = *n;
    } else {
      problems.push_back("normal is zero or not finite; expected a direction");
    }
  }
  std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment) const override {
    const Vec3d to_point = m_point - ray.o;
    const double speed = dot(m_n, ray.d);
    const double t = dot(m_n, to_point) / speed;  // parallel: infinite or no number, in no segment
    if (!(t > segment.t0 && t < segment.t1)) return std::nullopt;
    const bool is_inside = speed > 0.0;
    const double error = surface_error(length(ray.o) + length(to_point) + t);
    return SurfaceHit{t, is_inside ? -m_n : m_n, error, is_inside};
  }
  /// All of one side is shaded: the edge is the plane itself, where rays end.
  bool knows_shadow_edges() const override { return true; }

  /// A convex box lies between a plane and a sun as a whole, or one of its corners does not.
  bool may_shadow(const Box3d& box, const Vec3d& towards_sun) const override {
    for (int n = 0; n < 8; ++n) {
      const Vec3d corner(n & 1 ? box.max.x : box.min.x, n & 2 ? box.max.y : box.min.y,
                         n & 4 ? box.max.z : box.min.z);
      if (intersect({corner, towards_sun}, {0.0, std::numeric_limits<double>::infinity()})) return true;
    }
    return !(std::isfinite(box.min.length2()) && std::isfinite(box.max.length2()));
  }
  /// Height above the plane is linear along a line.
  Shade shade_between(const Vec3d& p0, const Vec3d& p1, const Vec3d& wi, double off) const override {
    constexpr double kRounding = 1e-11;
    const double margin = off + kRounding * (length(p0) + length(p1) + length(m_point));
    const double h0 = dot(m_n, p0 - m_point), h1 = dot(m_n, p1 - m_point), up = dot(m_n, wi);
    const bool is_one_sided = std::min(std::abs(h0), std::abs(h1)) > margin && (h0 > 0.0) == (h1 > 0.0);
    if (!is_one_sided || std::abs(up) < kRounding) return Shade::unknown;
    return (h0 > 0.0) == (up > 0.0) ? Shade::none : Shade::all;
  }
  Box3d bounds() const override {
    Box3d everything;
    everything.makeInfinite();
    return everything;
  }
};

}  // namespace

PILEUS_PLUGIN(Shape, plane, Plane, "an infinite plane")

}  // namespace pileus
