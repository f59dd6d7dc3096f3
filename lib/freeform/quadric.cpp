#include "lib/freeform/quadric.h"

#include <cmath>

namespace pileus {

namespace {

/// Gradient with respect to local coordinates.
Vec3d local_gradient(const Quadric& q, const Vec3d& p) {
  return {2 * q.a11 * p.x + q.a12 * p.y + q.a13 * p.z + q.a14,
          2 * q.a22 * p.y + q.a12 * p.x + q.a23 * p.z + q.a24,
          2 * q.a33 * p.z + q.a13 * p.x + q.a23 * p.y + q.a34};
}

double local_value(const Quadric& q, const Vec3d& p) {
  return q.a11 * p.x * p.x + q.a22 * p.y * p.y + q.a33 * p.z * p.z + q.a12 * p.x * p.y + q.a13 * p.x * p.z +
         q.a23 * p.y * p.z + q.a14 * p.x + q.a24 * p.y + q.a34 * p.z + q.a44;
}

/// Maximum of g v + a v² over |v| <= h.
double axis_maximum(double g, double a, double h) {
  const bool peaks_inside = a < 0 && std::fabs(g) < -2 * a * h;
  return peaks_inside ? -g * g / (4 * a) : std::fabs(g) * h + a * h * h;
}

}  // namespace

double Quadric::value(const Vec3d& p_world) const {
  return local_value(*this, local_from_world(p_world));
}

Vec3d Quadric::gradient(const Vec3d& p_world) const {
  return local_gradient(*this, local_from_world(p_world)) / size;
}

double Quadric::upper_bound(const Box3d& box_world) const {
  // METHODS §4.4, expanded about the centre of the box. The corners become local first: rounding is monotone,
  // so the local box holds the local coordinates of every point of the box however far away that is.
  const Vec3d low = local_from_world(box_world.min), high = local_from_world(box_world.max);
  const Vec3d c = 0.5 * (low + high), h = 0.5 * (high - low);
  const Vec3d g = local_gradient(*this, c);
  return local_value(*this, c) + axis_maximum(g.x, a11, h.x) + axis_maximum(g.y, a22, h.y) +
         axis_maximum(g.z, a33, h.z) + std::fabs(a12) * h.x * h.y + std::fabs(a13) * h.x * h.z +
         std::fabs(a23) * h.y * h.z;
}

Quadric ellipsoid(const Vec3d& center, const Vec3d& radii) {
  Quadric quadric;
  quadric.center = center;
  quadric.size = radii;
  return quadric;
}

}  // namespace pileus
