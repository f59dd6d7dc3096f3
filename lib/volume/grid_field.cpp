#include "lib/volume/grid_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include "lib/core/parallel.h"
#include "lib/math/box.h"
#include "lib/math/trilinear.h"
#include "lib/volume/brick_grid.h"
#include "lib/volume/cell_stepper.h"
#include "lib/volume/quantized_bricks.h"

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

/// A box of cells in which all values are alike.
struct Tile : CellBox {
  double value;
};

/// Finds cells and their corner values; remembers the brick it was in. One per ray.
class CellReader {
 public:
  explicit CellReader(const BrickGrid& grid) : m_grid(grid) {}

  /// The largest box of equal values around a cell; none where the cell's corners must be read.
  std::optional<Tile> tile_around(const Vec3i& cell) {
    if (is_in_brick(cell)) return std::nullopt;
    const BrickGrid::Block* block = m_grid.block_at(cell);
    if (!block) return cube_around(cell, BrickGrid::kBlockCells, 0.0f);
    if (block->table == BrickGrid::Block::kUniform) {
      return cube_around(cell, BrickGrid::kBlockCells, block->whole.range.lo);
    }
    const BrickGrid::Brick& brick = m_grid.brick_at(*block, cell);
    if (brick.range.is_uniform()) return cube_around(cell, BrickGrid::kBrickCells, brick.range.lo);
    m_values = m_grid.values(brick);
    m_origin = origin_of(cell, BrickGrid::kBrickCells);
    return std::nullopt;
  }

  /// The values at the corners of a cell for which tile_around has just found none; false where all are 0.
  bool read_corners(const Vec3i& cell, Corners& values) const {
    const float* at =
        m_values + (cell.x & 7) * BrickGrid::kStrideX + (cell.y & 7) * BrickGrid::kStrideY + (cell.z & 7);
    constexpr int x = BrickGrid::kStrideX, y = BrickGrid::kStrideY, z = BrickGrid::kStrideZ;
    values = {at[0], at[x], at[y], at[x + y], at[z], at[x + z], at[y + z], at[x + y + z]};
    // Densities are >= 0, so the sum is 0 only where all are.
    return ((values[0] + values[1]) + (values[2] + values[3])) +
               ((values[4] + values[5]) + (values[6] + values[7])) >
           0.0;
  }

 private:
  static Vec3i origin_of(const Vec3i& cell, int size) {
    return {cell.x & ~(size - 1), cell.y & ~(size - 1), cell.z & ~(size - 1)};
  }
  static Tile cube_around(const Vec3i& cell, int size, float value) {
    const Vec3i lo = origin_of(cell, size);
    return {{lo, lo + Vec3i(size)}, value};
  }
  bool is_in_brick(const Vec3i& cell) const {
    return m_values && origin_of(cell, BrickGrid::kBrickCells) == m_origin;
  }

  const BrickGrid& m_grid;
  const float* m_values = nullptr;  ///< of the brick at m_origin
  Vec3i m_origin{0, 0, 0};
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

/// Something that is made once, by whoever needs it first.
template <class T>
class Lazy {
 public:
  template <class Make>
  const T& get(Make&& make) const {
    std::call_once(m_once, [&] { run_isolated([&] { m_value.emplace(make()); }); });
    return *m_value;
  }

 private:
  mutable std::once_flag m_once;
  mutable std::optional<T> m_value;
};

/// The voxels while bricks may still be made of them. Bricks of floats hold all of them: after these, the
/// voxels are not kept any more, and stand in the memory of nobody.
class PassingVoxels {
 public:
  explicit PassingVoxels(VoxelSource voxels)
      : m_voxels(std::make_shared<const VoxelSource>(std::move(voxels))) {}

  /// Null after let_go().
  std::shared_ptr<const VoxelSource> get() const {
    const std::lock_guard lock(m_mutex);
    return m_voxels;
  }
  void let_go() const {
    const std::lock_guard lock(m_mutex);
    m_voxels = nullptr;
  }

 private:
  mutable std::mutex m_mutex;
  mutable std::shared_ptr<const VoxelSource> m_voxels;
};

class GridField final : public DensityField {
 public:
  GridField(VoxelSource voxels, const Affine& world_from_index)
      : m_world_from_index(world_from_index),
        m_index_from_world(world_from_index.inverse()),
        m_lo(voxels.bounds().lo()),
        m_hi(voxels.bounds().hi()),
        m_cells(Vec3d(m_lo), Vec3d(m_hi)),
        m_bounds(box_around(world_from_index, m_cells)),
        m_max_density(double(voxels.max_value())),
        m_voxels(std::move(voxels)) {}

  bool has_bricks() const override { return true; }
  const BrickGrid* bricks() const override { return &grid(); }
  std::shared_ptr<const BrickPyramid> quantized_bricks() const override {
    if (!(quantization_scale(float(m_max_density)) > 0.0)) return nullptr;
    return m_quantized.get([&] {
      const std::shared_ptr<const VoxelSource> voxels = m_voxels.get();
      return std::make_shared<const BrickPyramid>(voxels ? build_quantized_bricks(*voxels)
                                                         : build_quantized_bricks(voxels_of(grid())));
    });
  }
  const Affine& index_from_world() const override { return m_index_from_world; }

  Box3d bounds() const override { return m_bounds; }

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
    CellReader reader(grid());
    Corners corners;
    for (size_t i = 0; i < rho.size(); ++i) {
      rho[i] = 0.0;
      const Vec3d p = index_ray.at(t0 + double(i) * dt);
      if (!in_bounds(p)) continue;
      ++counters.density_samples;
      const Vec3i cell(int(std::floor(p.x)), int(std::floor(p.y)), int(std::floor(p.z)));
      if (const std::optional<Tile> tile = reader.tile_around(cell)) {
        rho[i] = tile->value;
      } else if (reader.read_corners(cell, corners)) {
        rho[i] = trilinear(corners, p - Vec3d(cell));
      }
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

    CellReader reader(grid());
    CellStepper stepper(index_ray, first_cell(index_ray.at(segment.t0)));
    CellVisit now{segment.t0, segment.t0};
    while (now.t0 < segment.t1) {
      int axis = 0;
      const std::optional<Tile> tile = reader.tile_around(stepper.cell);
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

  const BrickGrid& grid() const {
    return m_grid.get([&] {
      BrickGrid bricks = build_brick_grid(m_voxels.get()->leaves(), m_voxels.get()->tiles());
      m_voxels.let_go();
      return bricks;
    });
  }

  Affine m_world_from_index, m_index_from_world;
  Vec3i m_lo, m_hi;  ///< all cells that may be non-zero, [lo, hi)
  Box3d m_cells;     ///< the same as a box of index space
  Box3d m_bounds;    ///< the same in the world
  double m_max_density;
  PassingVoxels m_voxels;
  Lazy<BrickGrid> m_grid;
  Lazy<std::shared_ptr<const BrickPyramid>> m_quantized;
};

}  // namespace

std::shared_ptr<const DensityField> make_grid_field(VoxelSource voxels, const Affine& world_from_index) {
  return std::make_shared<GridField>(std::move(voxels), world_from_index);
}

}  // namespace pileus
