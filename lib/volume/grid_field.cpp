#include "lib/volume/grid_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <nanovdb/NanoVDB.h>

#include "lib/core/error.h"
#include "lib/math/box.h"
#include "lib/math/trilinear.h"

namespace pileus {
namespace {

using Corners = std::array<double, 8>;

/// A stretch of the ray inside one cell, or inside a box of equal values.
struct CellVisit {
  double t0, t1;           ///< [m]
  Corners corners{};       ///< x fastest
  Vec3d p{0.0, 0.0, 0.0};  ///< entry in cell coordinates, [0, 1]^3
  Vec3d q{0.0, 0.0, 0.0};  ///< exit; neither matters where all corners are alike
};

/// A box of cells, [lo, hi), in which all values are alike.
struct Tile {
  Vec3i lo, hi;
  double value;
};

/// Finds cells and their corner values through a cached accessor. One per ray.
class CellReader {
 public:
  explicit CellReader(const nanovdb::FloatGrid& grid) : m_accessor(grid.getAccessor()) {}

  /// True where the cell's lower corner lies in a leaf: its corners must then be read.
  bool is_in_leaf(const Vec3i& cell) {
    const Vec3i origin(cell.x & ~7, cell.y & ~7, cell.z & ~7);
    if (!m_leaf || origin != m_leaf_origin) {
      m_leaf = m_accessor.probeLeaf(nanovdb::Coord(cell.x, cell.y, cell.z));
      m_leaf_origin = origin;
    }
    return m_leaf != nullptr;
  }

  /// The largest box of equal values around a cell that is in no leaf. The last layer of cells of a tile with
  /// a value interpolates towards its neighbours: there the answer is none, and the cell is read like one in
  /// a leaf.
  std::optional<Tile> tile_around(const Vec3i& cell) {
    const nanovdb::Coord ijk(cell.x, cell.y, cell.z);
    float value = 0.0f;
    m_accessor.probeValue(ijk, value);
    const int dim = int(m_accessor.getDim(ijk, 0));
    const Vec3i lo(cell.x & ~(dim - 1), cell.y & ~(dim - 1), cell.z & ~(dim - 1));
    if (value == 0.0f) return Tile{lo, lo + Vec3i(dim), 0.0};
    const bool is_interior = cell.x < lo.x + dim - 1 && cell.y < lo.y + dim - 1 && cell.z < lo.z + dim - 1;
    if (!is_interior) return std::nullopt;
    return Tile{lo, lo + Vec3i(dim - 1), value};
  }

  /// The values at the cell's corners; false where all are 0.
  bool read_corners(const Vec3i& cell, Corners& values) {
    const bool is_whole = is_in_leaf(cell) && (cell.x & 7) < 7 && (cell.y & 7) < 7 && (cell.z & 7) < 7;
    if (is_whole) {
      // Leaf values are ordered z fastest: x strides 64, y 8, z 1.
      const float* at = m_leaf->data()->mValues + ((cell.x & 7) << 6 | (cell.y & 7) << 3 | (cell.z & 7));
      values = {at[0], at[64], at[8], at[72], at[1], at[65], at[9], at[73]};
    } else {
      const nanovdb::Coord ijk(cell.x, cell.y, cell.z);
      for (int n = 0; n < 8; ++n) {
        values[size_t(n)] = m_accessor.getValue(ijk.offsetBy(n & 1, (n >> 1) & 1, n >> 2));
      }
    }
    // Densities are >= 0, so the sum is 0 only where all are.
    return ((values[0] + values[1]) + (values[2] + values[3])) +
               ((values[4] + values[5]) + (values[6] + values[7])) >
           0.0;
  }

 private:
  nanovdb::DefaultReadAccessor<float> m_accessor;
  const nanovdb::NanoLeaf<float>* m_leaf = nullptr;
  Vec3i m_leaf_origin;
};

/// Steps from cell to cell along a ray in index space. Every crossing parameter comes from the integer plane,
/// never from the one before, so no error piles up; each step enters the cell behind a plane, so it always
/// moves on; and the lengths add up to the whole by telescoping (METHODS §9.6). Axes along which the ray does
/// not move are never crossed.
class CellStepper {
 public:
  CellStepper(const Ray& index_ray, const Vec3i& first_cell) : cell(first_cell), m_ray(index_ray) {
    for (int axis = 0; axis < 3; ++axis) {
      m_inverse[axis] = m_ray.d[axis] == 0.0 ? 0.0 : 1.0 / m_ray.d[axis];
      m_forward[axis] = m_ray.d[axis] > 0.0;
    }
    for (int axis = 0; axis < 3; ++axis) m_exit[axis] = crossing(axis, cell[axis] + m_forward[axis]);
  }

  /// Where the ray leaves the present cell.
  double t_exit() const { return m_exit[exit_axis()]; }

  /// Enters the next cell; returns the axis of the plane that was crossed.
  int step() {
    const int axis = exit_axis();
    cell[axis] += m_forward[axis] ? 1 : -1;
    m_exit[axis] = crossing(axis, cell[axis] + m_forward[axis]);
    return axis;
  }

  /// Where the ray leaves a box of cells around the present one.
  double exit_of(const Tile& tile, int& axis) const {
    double t = std::numeric_limits<double>::infinity();
    axis = 0;
    for (int k = 0; k < 3; ++k) {
      const double t_k = crossing(k, m_forward[k] ? tile.hi[k] : tile.lo[k]);
      if (t_k < t) t = t_k, axis = k;
    }
    return t;
  }

  /// Enters the cell behind the plane of `axis` through which the ray leaves the tile at t. The other two
  /// indices come from the position, kept inside the tile just left.
  void leap(const Tile& tile, int axis, double t) {
    for (int k = 0; k < 3; ++k) {
      const double p = std::floor(m_ray.o[k] + t * m_ray.d[k]);
      cell[k] = int(std::clamp(p, double(tile.lo[k]), double(tile.hi[k] - 1)));
    }
    cell[axis] = m_forward[axis] ? tile.hi[axis] : tile.lo[axis] - 1;
    for (int k = 0; k < 3; ++k) m_exit[k] = crossing(k, cell[k] + m_forward[k]);
  }

  Vec3i cell;

 private:
  double crossing(int axis, int plane) const {
    return m_ray.d[axis] == 0.0 ? std::numeric_limits<double>::infinity()
                                : (plane - m_ray.o[axis]) * m_inverse[axis];
  }
  int exit_axis() const {
    if (m_exit[0] <= m_exit[1]) return m_exit[0] <= m_exit[2] ? 0 : 2;
    return m_exit[1] <= m_exit[2] ? 1 : 2;
  }

  const Ray& m_ray;
  double m_inverse[3], m_exit[3];
  bool m_forward[3];
};

Vec3d clamp_to_unit(const Vec3d& p) {
  return {std::clamp(p.x, 0.0, 1.0), std::clamp(p.y, 0.0, 1.0), std::clamp(p.z, 0.0, 1.0)};
}

/// Mean density between entry and exit: the 2-point Gauss rule, exact for the cubic, a convex sum of corner
/// values.
double mean_density(const CellVisit& visit) {
  constexpr double kNear = 0.21132486540518711775;  // (1 - 1/sqrt(3)) / 2
  const Vec3d across = visit.q - visit.p;
  return 0.5 * (trilinear(visit.corners, visit.p + kNear * across) +
                trilinear(visit.corners, visit.q - kNear * across));
}

class GridField final : public DensityField {
 public:
  GridField(nanovdb::GridHandle<nanovdb::HostBuffer> handle, const Affine& world_from_index)
      : m_handle(std::move(handle)),
        m_grid(m_handle.grid<float>()),
        m_world_from_index(world_from_index),
        m_index_from_world(world_from_index.inverse()) {
    PILEUS_CHECK(m_grid != nullptr);
    scan_nodes();
    m_cells = Box3d(Vec3d(m_lo), Vec3d(m_hi));
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
    walk(ray, segment, counters, [&](const CellVisit& visit) {
      pieces.push_back({visit.t0, visit.t1, trilinear_bernstein(visit.corners, visit.p, visit.q)});
      return true;
    });
  }

  double column(const Ray& ray, Segment segment, double enough, FieldCounters& counters) const override {
    double sum = 0.0;
    walk(ray, segment, counters, [&](const CellVisit& visit) {
      sum += (visit.t1 - visit.t0) * mean_density(visit);
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
      if (reader.read_corners(cell, corners)) rho[i] = trilinear(corners, p - Vec3d(cell.x, cell.y, cell.z));
    }
  }

 private:
  /// The ray in index space. Its d is not normalised: t stays the length in world space [m].
  Ray to_index(const Ray& ray) const {
    return {m_index_from_world.point(ray.o), m_index_from_world.direction(ray.d)};
  }

  bool in_bounds(const Vec3d& p) const {
    return p.x >= m_lo.x && p.x < m_hi.x && p.y >= m_lo.y && p.y < m_hi.y && p.z >= m_lo.z && p.z < m_hi.z;
  }

  /// Visits the non-zero cells and tiles along the ray in order; visit(CellVisit) returns false to stop.
  template <class Visit>
  void walk(const Ray& ray, Segment segment, FieldCounters& counters, Visit&& visit) const {
    const Ray index_ray = to_index(ray);
    segment = clip_to_box(index_ray, segment, m_cells);
    const bool is_ray = std::isfinite(index_ray.o.length2()) && std::isfinite(index_ray.d.length2()) &&
                        index_ray.d != Vec3d(0.0);
    if (segment.empty() || !is_ray) return;

    CellReader reader(*m_grid);
    CellStepper stepper(index_ray, first_cell(index_ray.at(segment.t0)));
    CellVisit now{segment.t0, segment.t0};
    while (now.t0 < segment.t1) {
      int axis = 0;
      const std::optional<Tile> tile =
          reader.is_in_leaf(stepper.cell) ? std::nullopt : reader.tile_around(stepper.cell);
      if (tile) {
        const double t = stepper.exit_of(*tile, axis);
        now.t1 = std::clamp(t, now.t0, segment.t1);
        if (tile->value == 0.0) {
          ++counters.leaps;
        } else if (now.t1 > now.t0) {
          ++counters.density_samples;
          now.corners.fill(tile->value);
          if (!visit(now)) return;
        }
        stepper.leap(*tile, axis, t);
      } else {
        now.t1 = std::clamp(stepper.t_exit(), now.t0, segment.t1);
        if (now.t1 > now.t0) {
          ++counters.density_samples;
          if (reader.read_corners(stepper.cell, now.corners)) {
            const Vec3d origin(stepper.cell);
            now.p = clamp_to_unit(index_ray.at(now.t0) - origin);
            now.q = clamp_to_unit(index_ray.at(now.t1) - origin);
            if (!visit(now)) return;
          }
        }
        axis = stepper.step();
      }
      now.t0 = now.t1;
      if (stepper.cell[axis] < m_lo[axis] || stepper.cell[axis] >= m_hi[axis]) return;
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

  /// Finds the box of all cells that may be non-zero and the largest density, inactive voxels included:
  /// interpolation reads them. Also clears the marks by which NanoVDB calls a node without active values one
  /// big tile: it may hold leaves that are there for the cells at their upper faces.
  void scan_nodes() {
    auto& tree = m_handle.grid<float>()->tree();
    for (uint32_t n = 0; n < tree.nodeCount(0); ++n) {
      const auto& leaf = tree.getFirstLeaf()[n];
      const float* values = leaf.data()->mValues;
      const float largest = *std::max_element(values, values + nanovdb::NanoLeaf<float>::SIZE);
      if (largest > 0.0f) add_values(leaf.origin(), 8, largest);
    }
    scan_tiles(tree.getFirstLower(), tree.nodeCount(1));
    scan_tiles(tree.getFirstUpper(), tree.nodeCount(2));
    const auto& root = *tree.root().data();
    for (uint32_t i = 0; i < root.mTableSize; ++i) {
      const auto* tile = root.tile(i);
      if (!tile->isChild() && tile->value > 0.0f) add_values(tile->origin(), 4096, tile->value);
    }
  }

  template <class Node>
  void scan_tiles(Node* nodes, uint32_t count) {
    for (uint32_t n = 0; n < count; ++n) {
      auto& data = *nodes[n].data();
      data.mFlags &= ~uint64_t(1);
      for (uint32_t i = 0; i < std::size(data.mTable); ++i) {
        if (data.isChild(i) || !(data.mTable[i].value > 0.0f)) continue;
        add_values(nodes[n].offsetToGlobalCoord(i), int(Node::ChildNodeType::dim()), data.mTable[i].value);
      }
    }
  }

  /// Takes note of a cube of voxels with a positive density. A voxel reaches one cell further on each side.
  void add_values(const nanovdb::Coord& origin, int dim, float largest) {
    for (int axis = 0; axis < 3; ++axis) {
      m_lo[axis] = std::min(m_lo[axis], origin[axis] - 1);
      m_hi[axis] = std::max(m_hi[axis], origin[axis] + dim);
    }
    m_max_density = std::max(m_max_density, double(largest));
  }

  nanovdb::GridHandle<nanovdb::HostBuffer> m_handle;
  const nanovdb::FloatGrid* m_grid;
  Affine m_world_from_index, m_index_from_world;
  Vec3i m_lo{std::numeric_limits<int>::max()},
      m_hi{std::numeric_limits<int>::min()};  ///< all cells that may be non-zero, [lo, hi)
  Box3d m_cells;                              ///< the same as a box of index space
  double m_max_density = 0.0;
};

}  // namespace

std::shared_ptr<const DensityField> make_grid_field(nanovdb::GridHandle<nanovdb::HostBuffer> grid,
                                                    const Affine& world_from_index) {
  return std::make_shared<GridField>(std::move(grid), world_from_index);
}

}  // namespace pileus
