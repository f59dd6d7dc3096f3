#include "lib/volume/grid_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <nanovdb/NanoVDB.h>

#include "lib/core/error.h"
#include "lib/math/box.h"
#include "lib/math/trilinear.h"

namespace pileus {
namespace {

using Corners = std::array<double, 8>;

/// Parameter at which a ray crosses the integer plane `plane` of an axis; always from the integer, so that no
/// error piles up along the ray.
double crossing(const Ray& ray, int axis, int plane) {
  return (plane - ray.o[axis]) / ray.d[axis];
}

/// A box of cells, [lo, hi), in which the field is alike all over.
struct CellBox {
  enum class Kind { empty, constant, cell } kind = Kind::empty;
  Vec3i lo, hi;
  double value = 0.0;  ///< of a constant box
};

/// Finds cells and their corner values through a cached accessor. One per ray.
class CellReader {
 public:
  explicit CellReader(const nanovdb::FloatGrid& grid) : m_accessor(grid.getAccessor()) {}

  /// The largest box around a cell that is known to be empty or constant; the cell alone where it is neither.
  CellBox box_around(const Vec3i& cell) {
    const nanovdb::Coord ijk(cell.x, cell.y, cell.z);
    if (m_accessor.probeLeaf(ijk)) return {CellBox::Kind::cell, cell, cell + Vec3i(1)};
    float value = 0.0f;
    const bool active = m_accessor.probeValue(ijk, value);
    const int dim = int(m_accessor.getDim(ijk, 0));
    const Vec3i lo(cell.x & ~(dim - 1), cell.y & ~(dim - 1), cell.z & ~(dim - 1));
    if (!active && value == 0.0f) return {CellBox::Kind::empty, lo, lo + Vec3i(dim)};
    // The last layer of a tile's cells interpolates towards its neighbours.
    const bool interior = cell.x < lo.x + dim - 1 && cell.y < lo.y + dim - 1 && cell.z < lo.z + dim - 1;
    if (interior) return {CellBox::Kind::constant, lo, lo + Vec3i(dim - 1), value};
    return {CellBox::Kind::cell, cell, cell + Vec3i(1)};
  }

  /// The values at the cell's corners, x fastest; false where all are 0.
  bool corners(const Vec3i& cell, Corners& values) {
    const nanovdb::Coord ijk(cell.x, cell.y, cell.z);
    const auto* leaf = m_accessor.probeLeaf(ijk);
    const bool inside_leaf = leaf && (cell.x & 7) < 7 && (cell.y & 7) < 7 && (cell.z & 7) < 7;
    if (inside_leaf) {
      // Leaf values are ordered z fastest: x strides 64, y 8, z 1.
      const float* at = leaf->data()->mValues + nanovdb::NanoLeaf<float>::CoordToOffset(ijk);
      values = {at[0], at[64], at[8], at[72], at[1], at[65], at[9], at[73]};
    } else {
      for (int n = 0; n < 8; ++n) {
        values[size_t(n)] = m_accessor.getValue(ijk.offsetBy(n & 1, (n >> 1) & 1, n >> 2));
      }
    }
    return std::any_of(values.begin(), values.end(), [](double v) { return v != 0.0; });
  }

 private:
  nanovdb::DefaultReadAccessor<float> m_accessor;
};

Vec3d clamp_to_unit(const Vec3d& p) {
  return {std::clamp(p.x, 0.0, 1.0), std::clamp(p.y, 0.0, 1.0), std::clamp(p.z, 0.0, 1.0)};
}

class GridField final : public DensityField {
 public:
  GridField(nanovdb::GridHandle<nanovdb::HostBuffer> handle, const Affine& world_from_index)
      : m_handle(std::move(handle)),
        m_grid(m_handle.grid<float>()),
        m_world_from_index(world_from_index),
        m_index_from_world(world_from_index.inverse()) {
    PILEUS_CHECK(m_grid != nullptr);
    const nanovdb::CoordBBox active = m_grid->indexBBox();
    // A voxel reaches one cell further on each side.
    m_lo = Vec3i(active.min()[0] - 1, active.min()[1] - 1, active.min()[2] - 1);
    m_hi = Vec3i(active.max()[0] + 1, active.max()[1] + 1, active.max()[2] + 1);
    m_cells = Box3d(Vec3d(m_lo), Vec3d(m_hi));
    m_max_density = find_max_density();
  }

  Box3d bounds() const override {
    Box3d box;
    for (int n = 0; n < 8; ++n) {
      const Vec3d corner(n & 1 ? m_hi.x : m_lo.x, n & 2 ? m_hi.y : m_lo.y, n & 4 ? m_hi.z : m_lo.z);
      box.extendBy(m_world_from_index.point(corner));
    }
    return box;
  }

  double max_density() const override { return m_max_density; }

  double feature_size() const override {
    double smallest = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      Vec3d edge(0.0);
      edge[axis] = 1.0;
      smallest = std::min(smallest, length(m_world_from_index.direction(edge)));
    }
    return smallest;
  }

  void append_pieces(const Ray& ray, Segment segment, std::vector<DensityPiece>& pieces,
                     FieldCounters& counters) const override {
    walk(ray, segment, counters, [&](double t0, double t1, const std::array<double, 4>& rho) {
      pieces.push_back({t0, t1, rho});
      return true;
    });
  }

  double column(const Ray& ray, Segment segment, double enough, FieldCounters& counters) const override {
    double sum = 0.0;
    walk(ray, segment, counters, [&](double t0, double t1, const std::array<double, 4>& rho) {
      sum += 0.25 * (t1 - t0) * ((rho[0] + rho[1]) + (rho[2] + rho[3]));
      return sum < enough;
    });
    return sum;
  }

  void sample(const Ray& ray, double t0, double dt, std::span<double> rho,
              FieldCounters& counters) const override {
    const Ray index_ray = to_index(ray);
    CellReader reader(*m_grid);
    Corners corners;
    for (size_t i = 0; i < rho.size(); ++i) {
      rho[i] = 0.0;
      const Vec3d p = index_ray.at(t0 + double(i) * dt);
      if (!in_bounds(p)) continue;
      ++counters.density_samples;
      const Vec3i cell(int(std::floor(p.x)), int(std::floor(p.y)), int(std::floor(p.z)));
      if (reader.corners(cell, corners)) rho[i] = trilinear(corners, p - Vec3d(cell.x, cell.y, cell.z));
    }
  }

  size_t memory_bytes() const override { return m_handle.size(); }

 private:
  /// The ray in index space. Its d is not normalised: t stays the length in world space [m].
  Ray to_index(const Ray& ray) const {
    return {m_index_from_world.point(ray.o), m_index_from_world.direction(ray.d)};
  }

  bool in_bounds(const Vec3d& p) const {
    return p.x >= m_lo.x && p.x < m_hi.x && p.y >= m_lo.y && p.y < m_hi.y && p.z >= m_lo.z && p.z < m_hi.z;
  }

  /// Visits the non-zero cells along the ray in order: visit(t0, t1, control values) returns false to stop.
  /// Each step ends at the crossing of an integer plane and enters the cell behind that plane, so it always
  /// moves on, and the lengths add up to the whole stretch by telescoping (METHODS §9.6).
  template <class Visit>
  void walk(const Ray& ray, Segment segment, FieldCounters& counters, Visit&& visit) const {
    const Ray index_ray = to_index(ray);
    segment = clip_to_box(index_ray, segment, m_cells);
    const bool is_finite = std::isfinite(index_ray.o.length2()) && std::isfinite(index_ray.d.length2());
    if (segment.empty() || !is_finite) return;

    CellReader reader(*m_grid);
    Corners corners;
    Vec3i cell = first_cell(index_ray.at(segment.t0));
    double t = segment.t0;
    while (t < segment.t1) {
      const CellBox box = reader.box_around(cell);
      const auto [axis, t_exit] = exit_of(index_ray, box);
      const double t_next = std::clamp(t_exit, t, segment.t1);
      if (box.kind == CellBox::Kind::empty) {
        ++counters.leaps;
      } else if (t_next > t) {
        ++counters.density_samples;
        if (box.kind == CellBox::Kind::constant) {
          if (!visit(t, t_next, {box.value, box.value, box.value, box.value})) return;
        } else if (reader.corners(cell, corners)) {
          const Vec3d origin(cell.x, cell.y, cell.z);
          const Vec3d entry = clamp_to_unit(index_ray.at(t) - origin);
          const Vec3d exit = clamp_to_unit(index_ray.at(t_next) - origin);
          if (!visit(t, t_next, trilinear_bernstein(corners, entry, exit))) return;
        }
      }
      if (axis < 0) return;  // no axis moves: the ray has no direction in index space
      t = t_next;
      cell = enter_next(index_ray, box, axis, t_exit);
      if (cell[axis] < m_lo[axis] || cell[axis] >= m_hi[axis]) return;
    }
  }

  /// The cell that holds p, kept inside the grid's box against rounding at its faces.
  Vec3i first_cell(const Vec3d& p) const {
    Vec3i cell;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] = int(std::clamp(std::floor(p[axis]), double(m_lo[axis]), double(m_hi[axis] - 1)));
    }
    return cell;
  }

  /// The axis through whose plane the ray leaves the box first, and where; axis -1 where it never does.
  static std::pair<int, double> exit_of(const Ray& ray, const CellBox& box) {
    std::pair<int, double> exit{-1, std::numeric_limits<double>::infinity()};
    for (int axis = 0; axis < 3; ++axis) {
      if (ray.d[axis] == 0.0) continue;
      const double t = crossing(ray, axis, ray.d[axis] > 0.0 ? box.hi[axis] : box.lo[axis]);
      if (t < exit.second) exit = {axis, t};
    }
    return exit;
  }

  /// The cell behind the exit plane. The other two indices come from the position, kept inside the box just
  /// left.
  static Vec3i enter_next(const Ray& ray, const CellBox& box, int axis, double t_exit) {
    Vec3i cell;
    for (int k = 0; k < 3; ++k) {
      const double p = std::floor(ray.o[k] + t_exit * ray.d[k]);
      cell[k] = int(std::clamp(p, double(box.lo[k]), double(box.hi[k] - 1)));
    }
    cell[axis] = ray.d[axis] > 0.0 ? box.hi[axis] : box.lo[axis] - 1;
    return cell;
  }

  double find_max_density() const {
    const auto& tree = m_grid->tree();
    float largest = 0.0f;
    for (uint32_t n = 0; n < tree.nodeCount(0); ++n) {
      const float* values = tree.getFirstLeaf()[n].data()->mValues;
      largest = std::max(largest, *std::max_element(values, values + nanovdb::NanoLeaf<float>::SIZE));
    }
    const auto visit_tiles = [&](const auto* nodes, uint32_t count) {
      for (uint32_t n = 0; n < count; ++n) {
        const auto& data = *nodes[n].data();
        for (uint32_t i = 0; i < std::size(data.mTable); ++i) {
          if (!data.isChild(i)) largest = std::max(largest, data.mTable[i].value);
        }
      }
    };
    visit_tiles(tree.getFirstLower(), tree.nodeCount(1));
    visit_tiles(tree.getFirstUpper(), tree.nodeCount(2));
    const auto& root = *tree.root().data();
    for (uint32_t i = 0; i < root.mTableSize; ++i) {
      if (!root.tile(i)->isChild()) largest = std::max(largest, root.tile(i)->value);
    }
    return largest;
  }

  nanovdb::GridHandle<nanovdb::HostBuffer> m_handle;
  const nanovdb::FloatGrid* m_grid;
  Affine m_world_from_index, m_index_from_world;
  Vec3i m_lo, m_hi;  ///< all cells that may be non-zero, [lo, hi)
  Box3d m_cells;     ///< the same as a box of index space
  double m_max_density = 0.0;
};

}  // namespace

std::shared_ptr<const DensityField> make_grid_field(nanovdb::GridHandle<nanovdb::HostBuffer> grid,
                                                    const Affine& world_from_index) {
  return std::make_shared<GridField>(std::move(grid), world_from_index);
}

}  // namespace pileus
