#include "bench/forms/form_mesh.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "lib/math/interval.h"
#include "lib/volume/brick_grid.h"

namespace pileus::bench {
namespace {

class FormMesher {
 public:
  FormMesher(const FreeForm& form, double edge) : m_form(form), m_edge(edge) {
    const Box3d& box = form.bounds();
    m_origin = box.min - Vec3d(1.37 * edge);  // no axis of symmetry among the nodes
    const Vec3d size = box.max - m_origin;
    const double cells = std::max({size.x, size.y, size.z}) / edge + 2.0;
    int level = 0;
    while (double(kBlock << level) < cells) ++level;
    find_blocks({0, 0, 0}, kBlock << level);
    for (const Vec3i& block : m_blocks) add_vertices(block);
    for (const Vec3i& block : m_blocks) add_triangles(block);
  }

  MeshData mesh;

 private:
  static constexpr int kBlock = 8, kNodes = kBlock + 1;

  Vec3d at(const Vec3i& node) const { return m_origin + m_edge * Vec3d(node); }

  /// Blocks of cells in which the surface may be; those of the next cells, too, so that both sides know them.
  void find_blocks(const Vec3i& lo, int size) {
    const Interval range = m_form.range({at(lo), at(lo + Vec3i(size + 1))});
    if (range.lo > 0.0 || range.hi < 0.0) return;
    if (size == kBlock) {
      m_blocks.push_back(lo);
      return;
    }
    for (int n = 0; n < 8; ++n) {
      const int half = size / 2;
      find_blocks(lo + half * Vec3i(n & 1, n >> 1 & 1, n >> 2), half);
    }
  }

  void read(const Vec3i& block) {
    for (int x = 0; x < kNodes; ++x) {
      for (int y = 0; y < kNodes; ++y) {
        for (int z = 0; z < kNodes; ++z)
          m_values[size_t((x * kNodes + y) * kNodes + z)] = m_form.value(at(block + Vec3i(x, y, z)));
      }
    }
  }
  double value(const Vec3i& node) const {
    return m_values[size_t((node.x * kNodes + node.y) * kNodes + node.z)];
  }

  /// One for each cell with a change of sign: the mean of where its edges meet the surface.
  void add_vertices(const Vec3i& block) {
    read(block);
    for (int x = 0; x < kBlock; ++x) {
      for (int y = 0; y < kBlock; ++y) {
        for (int z = 0; z < kBlock; ++z) add_vertex(block, {x, y, z});
      }
    }
  }

  void add_vertex(const Vec3i& block, const Vec3i& cell) {
    Vec3d sum(0.0);
    int crossings = 0;
    for (int axis = 0; axis < 3; ++axis) {
      Vec3i along(0), u(0), v(0);
      along[axis] = u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1;
      for (int n = 0; n < 4; ++n) {
        const Vec3i a = cell + (n & 1) * u + (n >> 1) * v, b = a + along;
        const double f_a = value(a), f_b = value(b);
        if ((f_a >= 0.0) == (f_b >= 0.0)) continue;
        sum += at(block + a) + f_a / (f_a - f_b) * m_edge * Vec3d(along);
        ++crossings;
      }
    }
    if (crossings == 0) return;
    const Vec3d p = on_surface(sum / double(crossings));
    m_vertices[block + cell] = uint32_t(mesh.vertices.size());
    mesh.vertices.push_back(Vec3f(p));
  }

  /// Newton's steps along the gradient, as long as they stay near.
  Vec3d on_surface(const Vec3d& start) const {
    Vec3d p = start;
    for (int step = 0; step < 4; ++step) {
      const Vec3d g = m_form.gradient(p);
      const double g2 = dot(g, g);
      if (!(g2 > 0.0)) return start;
      p -= m_form.value(p) / g2 * g;
    }
    return length(p - start) < m_edge ? p : start;
  }

  /// Four cells around an edge that meets the surface make two triangles.
  void add_triangles(const Vec3i& block) {
    read(block);
    for (int axis = 0; axis < 3; ++axis) {
      Vec3i along(0), u(0), v(0);
      along[axis] = u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1;
      for (int x = 0; x < kBlock; ++x) {
        for (int y = 0; y < kBlock; ++y) {
          for (int z = 0; z < kBlock; ++z) {
            const Vec3i a(x, y, z);
            const bool is_inside = value(a) >= 0.0;
            if (is_inside == (value(a + along) >= 0.0)) continue;
            const Vec3i cell = block + a;
            const uint32_t q[4] = {m_vertices.at(cell), m_vertices.at(cell - u), m_vertices.at(cell - u - v),
                                   m_vertices.at(cell - v)};
            const int second = is_inside ? 1 : 3, last = is_inside ? 3 : 1;
            mesh.triangles.push_back({q[0], q[second], q[2]});
            mesh.triangles.push_back({q[0], q[2], q[last]});
          }
        }
      }
    }
  }

  const FreeForm& m_form;
  double m_edge;
  Vec3d m_origin;
  std::vector<Vec3i> m_blocks;
  BlockMap<uint32_t> m_vertices;  ///< of cells
  double m_values[size_t(kNodes) * kNodes * kNodes];
};

}  // namespace

MeshData mesh_of(const FreeForm& form, double edge) {
  return FormMesher(form, edge).mesh;
}

}  // namespace pileus::bench
