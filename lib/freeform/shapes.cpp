#include "lib/freeform/shapes.h"

#include <cmath>

namespace pileus {

Frame frame_along(const Vec3d& center, const Vec3d& axis, double radius, double height) {
  const Vec3d z = axis / length(axis);
  const bool leans_to_x = std::fabs(z.x) > std::fabs(z.y) && std::fabs(z.x) > std::fabs(z.z);
  const Vec3d x = normalize(cross(leans_to_x ? Vec3d(0, 1, 0) : Vec3d(1, 0, 0), z));
  return Frame(center, {x * radius, cross(z, x) * radius, z * height});
}

Quadric ellipsoid(const Vec3d& center, const Vec3d& radii) {
  return Quadric(Frame(center, radii), {});
}

Quadric sphere(const Vec3d& center, double radius) {
  return ellipsoid(center, Vec3d(radius));
}

Quadric cylinder(const Vec3d& center, const Vec3d& axis, double radius) {
  return Quadric(frame_along(center, axis, radius, radius), {.a33 = 0.0});
}

Quadric cone(const Vec3d& apex, const Vec3d& axis, double radius, double height) {
  return Quadric(frame_along(apex, axis, radius, height), {.a33 = 1.0, .a44 = 0.0});
}

Quadric paraboloid(const Vec3d& vertex, const Vec3d& axis, double radius, double height) {
  return Quadric(frame_along(vertex, axis, radius, height), {.a33 = 0.0, .a34 = 1.0, .a44 = 0.0});
}

Quadric hyperboloid_of_one_sheet(const Vec3d& center, const Vec3d& axis, double radius, double height) {
  return Quadric(frame_along(center, axis, radius, height), {.a33 = 1.0});
}

Quadric hyperboloid_of_two_sheets(const Vec3d& center, const Vec3d& axis, double radius, double height) {
  return Quadric(frame_along(center, axis, radius, height), {.a33 = 1.0, .a44 = -1.0});
}

Quadric plane(const Vec3d& point, const Vec3d& normal, double size) {
  return Quadric(frame_along(point, normal, size, size),
                 {.a11 = 0.0, .a22 = 0.0, .a33 = 0.0, .a34 = -1.0, .a44 = 0.0});
}

Quadric plane_pair(const Vec3d& center, const Vec3d& normal, double thickness) {
  return Quadric(frame_along(center, normal, thickness / 2, thickness / 2), {.a11 = 0.0, .a22 = 0.0});
}

}  // namespace pileus
