#include "lib/cloud/cloud_body.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pileus {
namespace {

/// Rounding of values in single precision and of the offsets that they belong to, relative.
constexpr double kFloatError = 1e-6;

double value_at_depth(double depth) {
  const double x = std::min(depth, 1.0);
  return x * (2.0 - x);
}

double mesh_value(const MeshDistance& mesh, const Vec3d& p) {
  return value_at_depth(mesh.inside(p) / mesh.deepest());
}

}  // namespace

CloudBody::CloudBody(const FreeForm& form) : m_form(form) {}

CloudBody::CloudBody(const Quadric& base) : m_form(base) {}

CloudBody::CloudBody(std::shared_ptr<const MeshDistance> mesh) : m_mesh(std::move(mesh)) {}

const Box3d& CloudBody::bounds() const {
  return m_mesh ? m_mesh->bounds() : m_form.bounds();
}

double CloudBody::value(const Vec3d& p_world) const {
  return m_mesh ? mesh_value(*m_mesh, p_world) : m_form.value(p_world);
}

CloudBody::Local CloudBody::within(const Box3d& box_world) const {
  return m_mesh ? Local(*m_mesh, box_world) : Local(m_form.within(box_world));
}

CloudBody::Local::Local(const MeshDistance& mesh, const Box3d& box_world)
    : m_mesh(&mesh), m_anchor(0.5 * box_world.min + 0.5 * box_world.max) {
  const double depth = mesh.inside(m_anchor) / mesh.deepest(),
               reach = (1.0 + kFloatError) * 0.5 * length(box_world.size()) / mesh.deepest();
  const double rounding = 4.0 * std::numeric_limits<double>::epsilon() *
                          (length(box_world.min) + length(box_world.max)) / mesh.deepest();
  const auto widened = [&](double x, double way) {
    const double f = value_at_depth(x + way * (reach + rounding));
    return f + way * kFloatError * (1.0 + std::abs(f));
  };
  m_range = {widened(depth, -1.0), widened(depth, 1.0)};
}

CloudBody::Local CloudBody::Local::within(const Box3d& part_world) const {
  return m_mesh ? Local(*m_mesh, part_world) : Local(m_form->within(part_world));
}

void CloudBody::Local::values(std::span<const float> x, std::span<const float> y, std::span<const float> z,
                              std::span<float> f) const {
  if (!m_mesh) return m_form->values(x, y, z, f);
  for (size_t i = 0; i < x.size(); ++i)
    f[i] = float(mesh_value(*m_mesh, m_anchor + Vec3d(double(x[i]), double(y[i]), double(z[i]))));
}

void CloudBody::Local::values(const PointLattice& points, std::span<float> f) const {
  if (!m_mesh) return m_form->values(points, f);
  size_t at = 0;
  for (int i = 0; i < points.count.x; ++i) {
    for (int j = 0; j < points.count.y; ++j) {
      for (int k = 0; k < points.count.z; ++k, ++at)
        f[at] = float(mesh_value(*m_mesh, points.first + points.step * Vec3d(i, j, k)));
    }
  }
}

}  // namespace pileus
