#include "lib/geom/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <queue>
#include <utility>

#include "lib/core/error.h"

namespace pileus {
namespace {

/// The point of a triangle that is nearest to the origin of p, and what part of the triangle it belongs to.
/// ref: Ericson 2005, Real-Time Collision Detection, 5.1.5
struct Nearest {
  Vec3d point;
  int corner = -1, edge = -1;  ///< that it lies on; both -1: inside
};

Nearest nearest_on_triangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {a, 0, -1};
  const Vec3d bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0.0 && d4 <= d3) return {b, 1, -1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return {a + d1 / (d1 - d3) * ab, -1, 0};
  const Vec3d cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0.0 && d5 <= d6) return {c, 2, -1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return {a + d2 / (d2 - d6) * ac, -1, 2};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0)
    return {b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b), -1, 1};
  const double sum = va + vb + vc;
  return {a + vb / sum * ab + vc / sum * ac, -1, -1};
}

double angle_at(const Vec3d& corner, const Vec3d& one, const Vec3d& other) {
  const Vec3d a = one - corner, b = other - corner;
  return std::atan2(length(cross(a, b)), dot(a, b));
}

}  // namespace

MeshDistance::MeshDistance(const MeshData& mesh, const Affine& world_from_mesh) {
  join_corners(mesh, world_from_mesh);
  check_and_connect();
  turn_if_inside_out();
  std::vector<Box3d> boxes;
  for (const Triangle& triangle : m_triangles) {
    Box3d& box = boxes.emplace_back();
    for (const uint32_t corner : triangle.corners) box.extendBy(m_corners[corner]);
    m_bounds.extendBy(box);
  }
  m_index = PointIndex(boxes);
  find_deepest();
}

void MeshDistance::join_corners(const MeshData& mesh, const Affine& world_from_mesh) {
  std::map<std::array<float, 3>, uint32_t> known;
  std::vector<uint32_t> joined;
  for (const Vec3f& p : mesh.vertices) {
    // Adding 0 makes both zeros one.
    const auto [place, is_new] =
        known.try_emplace({p.x + 0.0f, p.y + 0.0f, p.z + 0.0f}, uint32_t(m_corners.size()));
    if (is_new) m_corners.push_back(world_from_mesh.point(Vec3d(p)));
    joined.push_back(place->second);
  }
  for (const auto& t : mesh.triangles) {
    const std::array<uint32_t, 3> corners{joined[t[0]], joined[t[1]], joined[t[2]]};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    m_triangles.push_back({corners, Vec3d(0.0), {Vec3d(0.0), Vec3d(0.0), Vec3d(0.0)}});
  }
}

/// Along each edge as many triangles run one way as the other. A triangle gets the sum of the normals there.
void MeshDistance::check_and_connect() {
  struct Edge {
    int balance = 0, count = 0;
    Vec3d normal{0.0, 0.0, 0.0};
  };
  std::map<std::pair<uint32_t, uint32_t>, Edge> edges;
  m_corner_normals.assign(m_corners.size(), Vec3d(0.0));
  const auto edge_of = [&](const Triangle& triangle, size_t k) -> std::pair<Edge&, int> {
    const uint32_t a = triangle.corners[k], b = triangle.corners[(k + 1) % 3];
    return {edges[{std::min(a, b), std::max(a, b)}], a < b ? 1 : -1};
  };
  for (Triangle& triangle : m_triangles) {
    const Vec3d &a = m_corners[triangle.corners[0]], &b = m_corners[triangle.corners[1]],
                &c = m_corners[triangle.corners[2]];
    const Vec3d across = cross(b - a, c - a);
    const double area = length(across);
    if (area > 0.0) triangle.normal = across / area;
    for (size_t k = 0; k < 3; ++k) {
      const auto [edge, way] = edge_of(triangle, k);
      edge.balance += way, ++edge.count;
      edge.normal += triangle.normal;
      const Vec3d& corner = m_corners[triangle.corners[k]];
      m_corner_normals[triangle.corners[k]] += angle_at(corner, m_corners[triangle.corners[(k + 1) % 3]],
                                                        m_corners[triangle.corners[(k + 2) % 3]]) *
                                               triangle.normal;
    }
  }
  for (const auto& [ends, edge] : edges) {
    if (edge.balance == 0) continue;
    const Vec3d &a = m_corners[ends.first], &b = m_corners[ends.second];
    throw Error(
        ErrorKind::failed, SourceLoc{},
        fmt::format("the surface is not closed: the edge from ({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, "
                    "{:.6g}) belongs to {} {}; expected as many triangles on either side of each edge, all "
                    "turned the same way",
                    a.x, a.y, a.z, b.x, b.y, b.z, edge.count,
                    edge.count == 1 ? "triangle" : "triangles that are turned different ways"));
  }
  for (Triangle& triangle : m_triangles) {
    for (size_t k = 0; k < 3; ++k) triangle.edge_normals[k] = edge_of(triangle, k).first.normal;
  }
}

void MeshDistance::turn_if_inside_out() {
  double volume = 0.0;
  for (const Triangle& triangle : m_triangles) {
    const Vec3d &o = m_corners[m_triangles[0].corners[0]], a = m_corners[triangle.corners[0]] - o,
                b = m_corners[triangle.corners[1]] - o, c = m_corners[triangle.corners[2]] - o;
    volume += dot(a, cross(b, c));
  }
  if (volume == 0.0) {
    throw Error(ErrorKind::failed, SourceLoc{}, "the surface encloses nothing; expected a closed surface");
  }
  if (volume > 0.0) return;
  for (Triangle& triangle : m_triangles) {
    triangle.normal = -triangle.normal;
    for (Vec3d& normal : triangle.edge_normals) normal = -normal;
  }
  for (Vec3d& normal : m_corner_normals) normal = -normal;
}

double MeshDistance::inside(const Vec3d& p) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (!std::isfinite(length(p))) return -kInfinity;
  double nearest2 = kInfinity, side = -1.0;
  size_t nearest = 0;
  const Vec3d middle = 0.5 * m_bounds.min + 0.5 * m_bounds.max;
  m_index.visit(p, length(p - middle) + length(m_bounds.size()), [&](size_t number, double& radius) {
    const Triangle& triangle = m_triangles[number];
    if (triangle.normal == Vec3d(0.0)) return;  // its neighbours have all of its points
    const Nearest found = nearest_on_triangle(p, m_corners[triangle.corners[0]],
                                              m_corners[triangle.corners[1]], m_corners[triangle.corners[2]]);
    const Vec3d away = p - found.point;
    const double distance2 = dot(away, away);
    // Of triangles that are equally near the first counts, whatever the order.
    if (distance2 > nearest2 || (distance2 == nearest2 && number > nearest)) return;
    nearest2 = distance2, nearest = number;
    const Vec3d& normal = found.corner >= 0 ? m_corner_normals[triangle.corners[size_t(found.corner)]]
                          : found.edge >= 0 ? triangle.edge_normals[size_t(found.edge)]
                                            : triangle.normal;
    side = dot(away, normal) < 0.0 ? 1.0 : -1.0;
    radius = std::sqrt(distance2);
  });
  return side * std::sqrt(nearest2);
}

/// The largest of the distances in a box is at most that in its middle and half its diagonal: the box where
/// that is most is divided until it is hardly more than what has been found.
void MeshDistance::find_deepest() {
  struct Part {
    double most;
    Vec3d middle, half;
    bool operator<(const Part& other) const { return most < other.most; }
  };
  constexpr double kEnough = 1.01;
  constexpr int kMostParts = 100000;
  double found = 0.0;
  std::priority_queue<Part> parts;
  const auto add = [&](const Vec3d& middle, const Vec3d& half) {
    const double here = inside(middle);
    found = std::max(found, here);
    parts.push({here + length(half), middle, half});
  };
  add(0.5 * m_bounds.min + 0.5 * m_bounds.max, 0.5 * m_bounds.size());
  for (int n = 0; n < kMostParts && parts.top().most > kEnough * found; ++n) {
    const Part part = parts.top();
    parts.pop();
    const Vec3d half = 0.5 * part.half;
    for (int k = 0; k < 8; ++k) {
      const Vec3d way(k & 1 ? 1.0 : -1.0, k & 2 ? 1.0 : -1.0, k & 4 ? 1.0 : -1.0);
      add(part.middle + way * half, half);
    }
  }
  m_deepest = parts.top().most;
}

}  // namespace pileus
