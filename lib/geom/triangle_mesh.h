#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "lib/geom/box_index.h"
#include "lib/math/ray.h"
#include "lib/math/vec.h"

namespace pileus {

/// Triangles as files hold them.
struct MeshData {
  std::vector<Vec3f> vertices;                     ///< [m], finite
  std::vector<Vec3f> normals;                      ///< one per vertex, or none at all
  std::vector<std::array<uint32_t, 3>> triangles;  ///< numbers of vertices
};

/// Keeps one of the vertices that have the same place and normal.
void join_equal_vertices(MeshData& mesh);

/// Gives vertices the mean normal of their triangles, by the angles that these have there. Vertices at one
/// place share it.
void make_smooth_normals(MeshData& mesh);

struct MeshHit {
  double t;
  Vec3d face_normal;    ///< of the triangle, unit length, on the ray's side; 0 where the triangle has no area
  Vec3d smooth_normal;  ///< between the vertices' normals, unit length, on the ray's side; 0 where there is
                        ///< none
  bool is_inside;       ///< the ray meets the back: corners are in clockwise order as it sees them
  double error;         ///< [m] bound on how far the point at t lies from the triangle
};

/// Triangles that rays meet in double precision, without cracks: a ray that passes between two triangles that
/// share an edge or a vertex meets one of them, wherever it starts. Immutable; safe from many threads.
///
/// ref: Woop, Benthin, Wald 2013, Watertight ray/triangle intersection (JCGT 2(1)); here the signs of edge
/// functions are exact, and so are the weights to a few roundings.
class TriangleMesh {
 public:
  /// errors: Error(failed) where memory does not suffice. Indices must be in range.
  explicit TriangleMesh(MeshData data);

  /// Nearest triangle with t in (segment.t0, segment.t1), seen from either side.
  ///   ray: in the space of the mesh, |d| = 1
  std::optional<MeshHit> intersect(const Ray& ray, Segment segment) const;

  Box3d bounds() const { return m_bounds; }
  const MeshData& data() const { return m_data; }

 private:
  MeshHit hit_of(const Ray& ray, double t, uint32_t triangle, const Vec3d& weights) const;

  MeshData m_data;
  Box3d m_bounds;
  double m_reach = 0.0;  ///< [m] from the origin to the farthest vertex
  BoxIndex m_index;
};

}  // namespace pileus
