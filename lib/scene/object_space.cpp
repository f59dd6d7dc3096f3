#include "lib/scene/object_space.h"

#include <cmath>
#include <limits>

#include "lib/math/box.h"
#include "lib/math/offset_point.h"

namespace pileus {
namespace {

/// At least as large as the factor by which the map may lengthen a vector.
double growth(const Affine& map) {
  const Imath::M44d& m = map.matrix();
  double sum = 0.0;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) sum += m[row][column] * m[row][column];
  }
  return std::sqrt(sum);
}

}  // namespace

ObjectSpace::ObjectSpace(const Affine& world_from_object)
    : m_object_from_world(world_from_object.inverse()),
      m_world_from_object(world_from_object),
      m_growth(growth(m_world_from_object)),
      m_shrinkage(growth(m_object_from_world)),
      m_offset(length(m_object_from_world.point(Vec3d(0.0)))) {}

ObjectSpace::LocalRay ObjectSpace::to_object(const Ray& ray, Segment segment) const {
  const Vec3d d = m_object_from_world.direction(ray.d);
  const double stretch = length(d);
  return {
      {m_object_from_world.point(ray.o), d / stretch}, {segment.t0 * stretch, segment.t1 * stretch}, stretch};
}

std::optional<SurfaceHit> ObjectSpace::to_world(const Ray& ray, Segment segment, const LocalRay& local,
                                                const SurfaceHit& hit) const {
  double t = hit.t / local.stretch;
  // A hit at the start of the segment must not fall out of it by rounding: it hides what is behind.
  if (!(t > segment.t0)) t = std::nextafter(segment.t0, std::numeric_limits<double>::infinity());
  if (!(t < segment.t1) || !std::isfinite(t)) return std::nullopt;
  // A normal is a gradient: it goes with the transpose of the map back.
  const Imath::M44d& m = m_object_from_world.matrix();
  const Vec3d n(m[0][0] * hit.n.x + m[0][1] * hit.n.y + m[0][2] * hit.n.z,
                m[1][0] * hit.n.x + m[1][1] * hit.n.y + m[1][2] * hit.n.z,
                m[2][0] * hit.n.x + m[2][1] * hit.n.y + m[2][2] * hit.n.z);
  const double travelled = length(ray.o) + std::fabs(t);
  const double in_object = hit.error + surface_error(m_shrinkage * travelled + m_offset);
  return SurfaceHit{t, normalize(n), m_growth * in_object + surface_error(travelled), hit.is_inside};
}

Box3d ObjectSpace::world_box(const Box3d& box) const {
  if (box.isEmpty()) return box;
  const Box3d result = box_around(m_world_from_object, box);
  const Vec3d farthest(std::max(std::fabs(box.min.x), std::fabs(box.max.x)),
                       std::max(std::fabs(box.min.y), std::fabs(box.max.y)),
                       std::max(std::fabs(box.min.z), std::fabs(box.max.z)));
  const double reach = length(farthest);
  const Vec3d margin(surface_error(m_growth * (reach + m_offset)));
  return {result.min - margin, result.max + margin};
}

}  // namespace pileus
