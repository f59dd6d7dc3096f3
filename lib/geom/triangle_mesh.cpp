#include "lib/geom/triangle_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "lib/math/offset_point.h"
#include "lib/math/two_product.h"

namespace pileus {
namespace {

/// a d - b c. The sign is exact, the value nearly so: what is left is rounded twice.
double exact_sign_determinant(double a, double b, double c, double d) {
  const TwoProduct<double> ad = two_product(a, d), bc = two_product(b, c);
  return (ad.value - bc.value) + (ad.error - bc.error);
}

/// The ray's own view of space: it looks along z from the origin, x and y are sheared away. Whatever triangle
/// a vertex belongs to, it comes out the same.
class RayView {
 public:
  explicit RayView(const Ray& ray) : m_o(ray.o) {
    const Vec3d size(std::fabs(ray.d.x), std::fabs(ray.d.y), std::fabs(ray.d.z));
    m_z = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    m_x = (m_z + 1) % 3, m_y = (m_z + 2) % 3;
    m_shear_x = ray.d[m_x] / ray.d[m_z];
    m_shear_y = ray.d[m_y] / ray.d[m_z];
    m_scale_z = 1.0 / ray.d[m_z];
  }

  /// z is in units of t.
  Vec3d operator()(const Vec3f& vertex) const {
    const Vec3d p = Vec3d(vertex) - m_o;
    return {p[m_x] - m_shear_x * p[m_z], p[m_y] - m_shear_y * p[m_z], m_scale_z * p[m_z]};
  }

 private:
  Vec3d m_o;
  int m_x, m_y, m_z;
  double m_shear_x, m_shear_y, m_scale_z;
};

struct TriangleCut {
  double t;
  Vec3d weights;  ///< of the corners; their sum is 1
};

/// Where the z axis of the view passes through a triangle, its edges and corners included.
std::optional<TriangleCut> cut(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  // Rounding keeps the order of two products, so their difference has the right sign where it is not 0.
  double u = c.x * b.y - c.y * b.x, v = a.x * c.y - a.y * c.x, w = b.x * a.y - b.y * a.x;
  if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) return std::nullopt;
  u = exact_sign_determinant(c.x, c.y, b.x, b.y);
  v = exact_sign_determinant(a.x, a.y, c.x, c.y);
  w = exact_sign_determinant(b.x, b.y, a.x, a.y);
  if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) return std::nullopt;
  const double sum = u + v + w;
  if (sum == 0.0 || !std::isfinite(sum)) return std::nullopt;  // seen from its edge
  const Vec3d weights(u / sum, v / sum, w / sum);
  return TriangleCut{weights.x * a.z + weights.y * b.z + weights.z * c.z, weights};
}

double angle_between(const Vec3d& a, const Vec3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b));
}

}  // namespace

void join_equal_vertices(MeshData& mesh) {
  using Key = std::array<float, 6>;
  const auto key = [&](uint32_t i) -> Key {
    const Vec3f p = mesh.vertices[i], n = mesh.normals.empty() ? Vec3f(0.0f) : mesh.normals[i];
    return {p.x, p.y, p.z, n.x, n.y, n.z};
  };
  std::vector<uint32_t> order(mesh.vertices.size()), joined(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return std::pair(key(a), a) < std::pair(key(b), b); });
  MeshData kept;
  for (size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || key(order[i]) != key(order[i - 1])) {
      kept.vertices.push_back(mesh.vertices[order[i]]);
      if (!mesh.normals.empty()) kept.normals.push_back(mesh.normals[order[i]]);
    }
    joined[order[i]] = uint32_t(kept.vertices.size() - 1);
  }
  for (const auto& corners : mesh.triangles) {
    kept.triangles.push_back({joined[corners[0]], joined[corners[1]], joined[corners[2]]});
  }
  mesh = std::move(kept);
}

void make_smooth_normals(MeshData& mesh) {
  std::map<std::tuple<float, float, float>, Vec3d> sums;
  const auto sum_at = [&](uint32_t vertex) -> Vec3d& {
    const Vec3f& p = mesh.vertices[vertex];
    return sums.try_emplace({p.x, p.y, p.z}, 0.0, 0.0, 0.0).first->second;
  };
  for (const auto& triangle : mesh.triangles) {
    for (size_t k = 0; k < 3; ++k) {
      const Vec3d p(mesh.vertices[triangle[k]]);
      const Vec3d to_next = Vec3d(mesh.vertices[triangle[(k + 1) % 3]]) - p;
      const Vec3d to_last = Vec3d(mesh.vertices[triangle[(k + 2) % 3]]) - p;
      sum_at(triangle[k]) += angle_between(to_next, to_last) * normalize(cross(to_next, to_last));
    }
  }
  mesh.normals.clear();
  for (uint32_t i = 0; i < mesh.vertices.size(); ++i) mesh.normals.emplace_back(normalize(sum_at(i)));
}

TriangleMesh::TriangleMesh(MeshData data) : m_data(std::move(data)) {
  std::vector<Box3d> boxes(m_data.triangles.size());
  for (size_t i = 0; i < boxes.size(); ++i) {
    for (const uint32_t vertex : m_data.triangles[i]) {
      const Vec3d p(m_data.vertices[vertex]);
      boxes[i].extendBy(p);
      m_reach = std::max(m_reach, length(p));
    }
    m_bounds.extendBy(boxes[i]);
  }
  m_index = BoxIndex(boxes);
}

std::optional<MeshHit> TriangleMesh::intersect(const Ray& ray, Segment segment) const {
  const RayView view(ray);
  std::optional<TriangleCut> nearest;
  uint32_t number = 0;
  m_index.visit(ray, segment, [&](size_t i, double& t1) {
    const auto& triangle = m_data.triangles[i];
    const auto met = cut(view(m_data.vertices[triangle[0]]), view(m_data.vertices[triangle[1]]),
                         view(m_data.vertices[triangle[2]]));
    if (!met || !(met->t > segment.t0)) return true;
    // Of triangles that share an edge the first counts, in whatever order they are asked.
    const bool is_nearer = met->t < t1 || (nearest && met->t == nearest->t && i < number);
    if (!is_nearer) return true;
    nearest = met;
    number = uint32_t(i);
    t1 = met->t;
    return true;
  });
  if (!nearest) return std::nullopt;
  return hit_of(ray, nearest->t, number, nearest->weights);
}

MeshHit TriangleMesh::hit_of(const Ray& ray, double t, uint32_t triangle, const Vec3d& weights) const {
  const auto& corners = m_data.triangles[triangle];
  const Vec3d a(m_data.vertices[corners[0]]), b(m_data.vertices[corners[1]]), c(m_data.vertices[corners[2]]);
  const Vec3d outwards = normalize(cross(b - a, c - a));
  const bool is_inside = dot(outwards, ray.d) > 0.0;
  // Shearing moves a corner by less than 12 roundings of the lengths here, weighing it by less than 8.
  MeshHit hit{t, is_inside ? -outwards : outwards, Vec3d(0.0), is_inside,
              2.0 * surface_error(length(ray.o) + std::fabs(t) + m_reach)};
  if (!m_data.normals.empty()) {
    const Vec3d n = weights.x * Vec3d(m_data.normals[corners[0]]) +
                    weights.y * Vec3d(m_data.normals[corners[1]]) +
                    weights.z * Vec3d(m_data.normals[corners[2]]);
    // On the side of the face: vertex normals may point the other way than the order of corners.
    const Vec3d unit = normalize(n);
    hit.smooth_normal = dot(unit, hit.face_normal) < 0.0 ? -unit : unit;
  }
  return hit;
}

}  // namespace pileus
