#pragma once

#include <array>
#include <vector>

#include "lib/geom/point_index.h"
#include "lib/geom/triangle_mesh.h"
#include "lib/math/affine.h"
#include "lib/math/vec.h"

namespace pileus {

/// Distances from a closed surface of triangles. The nearest point is found in double precision; which side
/// it is seen from, the normal there tells: of a triangle, the mean of two along their edge, the mean by
/// angles at a corner. Immutable; safe from many threads.
///
/// ref: Baerentzen, Aanaes 2005, Signed distance computation using the angle weighted pseudonormal
class MeshDistance {
 public:
  /// Corners at one place are joined, triangles without area left out, and a surface that is inside out is
  /// turned. errors: Error(failed) where the surface is not closed: where along some edge not as many
  /// triangles run one way as the other
  explicit MeshDistance(const MeshData& mesh, const Affine& world_from_mesh = Affine());

  /// Distance from the surface, > 0 inside [m]; errs by rounding.
  double inside(const Vec3d& p) const;

  /// No point lies deeper inside; at most a hundredth more than the deepest does.
  double deepest() const { return m_deepest; }

  const Box3d& bounds() const { return m_bounds; }

 private:
  struct Triangle {
    std::array<uint32_t, 3> corners;
    Vec3d normal;                       ///< outwards, unit length
    std::array<Vec3d, 3> edge_normals;  ///< of the edge behind each corner, of any length
  };

  void join_corners(const MeshData& mesh, const Affine& world_from_mesh);
  void check_and_connect();
  void turn_if_inside_out();
  void find_deepest();

  std::vector<Vec3d> m_corners, m_corner_normals;
  std::vector<Triangle> m_triangles;
  PointIndex m_index;
  Box3d m_bounds;
  double m_deepest = 0.0;
};

}  // namespace pileus
