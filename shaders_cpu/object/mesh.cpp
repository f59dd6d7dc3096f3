/// A mesh of triangles.
///
///   file      .obj, .ply, .gltf or .glb; see docs/meshes.md
///   smooth    light falls on it as if it were round between the corners: by the file's normals, or where it
///   has
///             none by the mean normals of the triangles around a corner; default false
///   scale, rotate_deg, translate   where it is put
///   shader    what light does on the surface; default phong
///
///   [object.shed]
///   type = "mesh"
///   file = "shed.obj"
///   translate = [4, 0, -2]
///
/// Seen from both sides. No ray slips through between triangles that share an edge.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lib/core/param_table.h"
#include "lib/geom/mesh_file.h"
#include "lib/geom/triangle_mesh.h"
#include "lib/scene/medium.h"
#include "lib/scene/object_space.h"
#include "lib/scene/shape.h"

namespace pileus {
namespace {

struct Mesh final : Shape {
  std::filesystem::path m_file;
  bool m_smooth = false;
  Placement m_placement;

  std::shared_ptr<const TriangleMesh> m_mesh;
  ObjectSpace m_space;
  Box3d m_bounds;

  void describe_form(ParamTable& params) override {
    params.file("file", m_file, "triangles: .obj, .ply, .gltf or .glb").required();
    params.boolean("smooth", m_smooth, "lit as if round between the corners");
    m_placement.describe(params);
  }

  void commit(std::vector<std::string>& problems) override {
    if (m_file.empty()) return;  // the reader has complained
    const Affine world_from_mesh = m_placement.world_from_object();
    if (!(std::fabs(world_from_mesh.determinant()) > 0.0)) {
      problems.push_back("the placement flattens the mesh; expected scales that are not 0");
      return;
    }
    MeshData data = read_mesh(m_file);
    if (!m_smooth) data.normals.clear();
    if (m_smooth && data.normals.empty()) make_smooth_normals(data);
    m_mesh = std::make_shared<const TriangleMesh>(std::move(data));
    m_space = ObjectSpace(world_from_mesh);
    m_bounds = m_space.world_box(m_mesh->bounds());
  }

  std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment) const override {
    return m_space.intersect(ray, segment,
                             [&](const Ray& in_mesh, Segment part) -> std::optional<SurfaceHit> {
                               const std::optional<MeshHit> hit = m_mesh->intersect(in_mesh, part);
                               if (!hit) return std::nullopt;
                               return with_normal(*hit, in_mesh.d);
                             });
  }

  Box3d bounds() const override { return m_bounds; }

 private:
  /// The smooth normal, where it is on the ray's side and leads out of the face steeply enough for rays that
  /// start along it to start off the face.
  static SurfaceHit with_normal(const MeshHit& hit, const Vec3d& d) {
    constexpr double kSteepest = 0.1;
    if (hit.face_normal.length2() == 0.0) return {hit.t, -d, hit.error, hit.is_inside};
    const double steepness = dot(hit.smooth_normal, hit.face_normal);
    if (steepness < kSteepest || dot(hit.smooth_normal, d) >= 0.0)
      return {hit.t, hit.face_normal, hit.error, hit.is_inside};
    return {hit.t, hit.smooth_normal, hit.error / steepness, hit.is_inside};
  }
};

}  // namespace

PILEUS_PLUGIN(Shape, mesh, Mesh, "triangles of an OBJ, PLY or glTF file")

}  // namespace pileus
