// The sweep that fills lattices of optical depth, and single columns.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_SUN_SWEEP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_SUN_SWEEP_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_SUN_SWEEP_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_SUN_SWEEP_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/density_rows-inl.h"
#include "integrators/kernels/readers-inl.h"
#include "integrators/kernels/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Whether a grid has no density in a box of its local space.
class EmptySpace {
 public:
  explicit EmptySpace(const BrickPyramid& pyramid) : m_pyramid(pyramid) {}

  /// Exact to nodes of about a quarter of the box, and of the given level at
  /// least.
  bool holds(const Box3d& box, size_t level) const {
    const Vec3d size = box.size();
    const double extent = std::max({size.x, size.y, size.z});
    while (level + 1 < m_pyramid.levels().size() && double(8 << level) < 0.25 * extent) ++level;
    const BrickPyramid::Level& nodes = m_pyramid.levels()[level];
    const double edge = double(8 << level);
    Vec3i lo, hi;
    for (int axis = 0; axis < 3; ++axis) {
      const double first = std::max(0.0, std::floor(box.min[axis] / edge)),
                   last = std::min(double(nodes.nodes[axis] - 1), std::floor(box.max[axis] / edge));
      if (!(first <= last)) return true;
      lo[axis] = int(first), hi[axis] = int(last);
    }
    for (int x = lo.x; x <= hi.x; ++x) {
      for (int y = lo.y; y <= hi.y; ++y) {
        const ValueRange* const row =
            nodes.ranges.data() + (size_t(x) * size_t(nodes.nodes.y) + size_t(y)) * size_t(nodes.nodes.z);
        for (int z = lo.z; z <= hi.z; ++z) {
          if (row[z].hi > 0.0f) return false;
        }
      }
    }
    return true;
  }

 private:
  const BrickPyramid& m_pyramid;
};

/// Sweeps the lines of some columns of bricks, and with them the lines beside,
/// from the sun's side down: eight cells at a time, which then become bricks.
/// Lanes are lines that are neighbours along v.
class SunSweeper {
 public:
  SunSweeper(const SunSweep& sweep, const Vec2i& first, const Vec2i& end, SunBricks& bricks)
      : m_sweep(sweep),
        m_bricks(bricks),
        m_pyramid(*sweep.grid->pyramid),
        m_empty(*sweep.grid->pyramid),
        m_first(first),
        m_end(end),
        m_rows((end.x - first.x) * kCells + 3),
        m_columns(((end.y - first.y) * kCells + 3 + int(kLanes) - 1) / int(kLanes) * int(kLanes)),
        m_pitch(size_t(m_columns) + kLanes),
        m_tau(size_t(kLevels) * size_t(m_rows) * m_pitch, 0.0f),
        m_rho(m_pitch, 0.0f),
        m_density(sweep, m_columns) {}

  void run() {
    for (int bw = m_bricks.lattice->bricks.z - 1; bw >= 0; --bw) {
      for (int row = 0; row < m_rows; ++row) sweep_row(row, bw);
      for (int bu = m_first.x; bu < m_end.x; ++bu) {
        for (int bv = m_first.y; bv < m_end.y; ++bv) store_brick({bu, bv, bw});
      }
      keep_last_levels();
    }
    m_bricks.samples += m_density.samples();
  }

 private:
  static constexpr int kCells = SunLattice::kBrickCells;
  static constexpr int kLevels = kCells + 3;  ///< level k holds the nodes at w = 8 bw - 1 + k

  float* row_at(int level, int row) {
    return m_tau.data() + (size_t(level) * size_t(m_rows) + size_t(row)) * m_pitch;
  }

  Vec3d local(double u, double v, double w) const {
    return m_sweep.origin + u * m_sweep.eu + v * m_sweep.ev + w * m_sweep.ew;
  }

  /// Box around the part of the lattice between two corners.
  Box3d box_around(const Vec3d& lo, const Vec3d& hi) const {
    Box3d box;
    box.min = box.max = local(lo.x, lo.y, lo.z);
    const Vec3d edges[3] = {(hi.x - lo.x) * m_sweep.eu, (hi.y - lo.y) * m_sweep.ev,
                            (hi.z - lo.z) * m_sweep.ew};
    for (const Vec3d& edge : edges) {
      for (int axis = 0; axis < 3; ++axis) {
        box.min[axis] += std::min(edge[axis], 0.0);
        box.max[axis] += std::max(edge[axis], 0.0);
      }
    }
    return box;
  }

  /// A row of lines, over the cells of a brick. All of them are at the same
  /// place but for the axis along which lanes lie, wherever they get.
  void sweep_row(int row, int bw) {
    const D d;
    const int u = m_first.x * kCells - 1 + row, v = m_first.y * kCells - 1, w0 = bw * kCells - 1;
    Box3d box = box_around(Vec3d(u, v, w0), Vec3d(u, v + m_columns - 1, w0 + kCells));
    if (m_sweep.is_halved)
      box = Box3d(box.min - Vec3d(DensityRows::kMeansReach), box.max + Vec3d(DensityRows::kMeansReach));
    find_lit_columns(row);
    if (m_lit_begin >= m_lit_end || m_empty.holds(box, 0)) {
      for (int level = 0; level < kCells; ++level)
        std::memcpy(row_at(level, row), row_at(kCells, row), m_pitch * sizeof(float));
      return;
    }
    const Vec3d start = local(u, v, w0), per_step = m_sweep.ew / m_sweep.steps;
    const V scale = hn::Set(d, float(m_sweep.grid->extinction * m_sweep.length / m_sweep.steps));
    for (int level = kCells - 1; level >= 0; --level) {
      bool has_density = false;
      for (int step = m_sweep.steps - 1; step >= 0; --step)
        has_density |= m_density.add(start + (level * m_sweep.steps + step + 0.5) * per_step, m_lit_begin,
                                     m_lit_end, m_rho.data());
      const float* const before = row_at(level + 1, row);
      float* const after = row_at(level, row);
      if (!has_density) {
        std::memcpy(after, before, m_pitch * sizeof(float));
        continue;
      }
      for (int column = 0; column < m_columns; column += int(kLanes)) {
        const V rho = hn::LoadU(d, m_rho.data() + column);
        const V tau = hn::MulAdd(rho, scale, hn::LoadU(d, before + column));
        hn::StoreU(hn::Min(tau, hn::Set(d, m_sweep.enough)), d, after + column);
        hn::StoreU(hn::Zero(d), d, m_rho.data() + column);
      }
    }
  }

  /// Lines that light still reaches at the upper end of the present cells lie
  /// between these.
  void find_lit_columns(int row) {
    const D d;
    const float* const tau = row_at(kCells, row);
    const auto is_dark = [&](int column) HWY_ATTR {
      return hn::AllTrue(d, hn::Ge(hn::LoadU(d, tau + column), hn::Set(d, m_sweep.enough)));
    };
    m_lit_begin = 0, m_lit_end = m_columns;
    while (m_lit_begin < m_lit_end && is_dark(m_lit_begin)) m_lit_begin += int(kLanes);
    while (m_lit_begin < m_lit_end && is_dark(m_lit_end - int(kLanes))) m_lit_end -= int(kLanes);
  }

  void keep_last_levels() {
    const size_t level = size_t(m_rows) * m_pitch;
    std::memmove(m_tau.data() + size_t(kCells) * level, m_tau.data(), 3 * level * sizeof(float));
  }

  void store_brick(const Vec3i& brick) {
    SunLattice& lattice = *m_bricks.lattice;
    int32_t& offset = lattice.offsets[(size_t(brick.x) * size_t(lattice.bricks.y) + size_t(brick.y)) *
                                          size_t(lattice.bricks.z) +
                                      size_t(brick.z)];
    offset = kLight;
    if (!is_wanted(brick)) return;
    alignas(64) uint16_t nodes[SunLattice::kPitch + 64];
    fill_nodes(brick, nodes);
    const bool is_uniform =
        std::all_of(nodes + 1, nodes + kNodes, [&](uint16_t node) { return node == nodes[0]; });
    if (is_uniform && nodes[0] == lattice.nodes[kLight]) return;
    if (is_uniform && nodes[0] == lattice.nodes[kDark]) {
      offset = kDark;
      return;
    }
    const int64_t slot = m_bricks.next.fetch_add(1);
    if (slot >= m_bricks.most) return;
    offset = int32_t(slot * SunLattice::kPitch);
    std::memcpy(lattice.nodes.get() + offset, nodes, kNodes * sizeof(uint16_t));
  }

  /// Whether there may be a density in some cell of the brick; rounding may
  /// move who reads it a little.
  bool is_wanted(const Vec3i& brick) const {
    if (m_sweep.is_everywhere) return true;
    constexpr double kMargin = 0.01;
    const Vec3d lo = Vec3d(brick * kCells) - Vec3d(kMargin);
    const double end = kCells + 2 * kMargin;
    if (m_empty.holds(box_around(lo, lo + Vec3d(end)), 0)) return false;
    for (int w = 0; w < kCells; ++w) {
      if (!m_empty.holds(box_around(lo + Vec3d(0, 0, w), lo + Vec3d(end, end, w + 1 + 2 * kMargin)), 0))
        return true;
    }
    return false;
  }

  /// The nodes of a brick, balanced: linear interpolation lies above a convex
  /// function by h^2/12 of its second derivative on average. Node values
  /// lowered by as much, as their second differences tell it, leave errors of
  /// changing sign, which cancel along a view ray (Blu, Thevenaz, Unser 2004).
  /// What light meets at the edge of a cloud then becomes slightly negative:
  /// transmittance takes that as it is. More than slightly is the sign of a
  /// lattice too coarse to be corrected, and would brighten: there is a floor.
  void fill_nodes(const Vec3i& brick, uint16_t* nodes) {
    const D d;
    const V two = hn::Set(d, 2.0f), four = hn::Set(d, 4.0f);
    const V share_across = hn::Set(d, balance(m_sweep.ev)), share_along = hn::Set(d, balance(m_sweep.ew));
    const int row0 = (brick.x - m_first.x) * kCells + 1, column0 = (brick.y - m_first.y) * kCells + 1;
    for (int u = 0; u <= kCells; ++u) {
      for (int w = 0; w <= kCells; ++w) {
        const float *here = row_at(w + 1, row0 + u) + column0,
                    *before = row_at(w + 1, row0 + u - 1) + column0,
                    *after = row_at(w + 1, row0 + u + 1) + column0, *below = row_at(w, row0 + u) + column0,
                    *above = row_at(w + 2, row0 + u) + column0;
        uint16_t* const out = nodes + u * SunLattice::kStrideU + w * SunLattice::kStrideW;
        // What a vector writes too much is overwritten by the next row.
        for (int v = 0; v <= kCells; v += int(kLanes)) {
          const V tau = hn::LoadU(d, here + v);
          const V across = hn::Add(hn::Add(hn::LoadU(d, before + v), hn::LoadU(d, after + v)),
                                   hn::Add(hn::LoadU(d, here + v - 1), hn::LoadU(d, here + v + 1)));
          const V along = hn::Add(hn::LoadU(d, below + v), hn::LoadU(d, above + v));
          const V lowered = hn::NegMulAdd(hn::NegMulAdd(four, tau, across), share_across,
                                          hn::NegMulAdd(hn::NegMulAdd(two, tau, along), share_along, tau));
          store_nodes(lowered, out + v);
        }
      }
    }
  }

  /// How much second differences between nodes an edge apart count: 1/12 for what interpolation does, and
  /// half of the variance by which means and what is between them are more blurred than the field: 1/4 and
  /// 4/6 less its own 1/6, in cells.
  float balance(const Vec3d& edge) const {
    constexpr double kMeansVariance = 0.75;
    const double blurred = m_sweep.is_halved ? 0.5 * kMeansVariance / dot(edge, edge) : 0.0;
    return float(1.0 / 12.0 + blurred);
  }

  void store_nodes(V tau, uint16_t* out) const {
    const D d;
    const DI di;
    const hn::Rebind<uint16_t, D> du16;
    const V shifted =
        hn::Add(hn::Min(hn::Max(tau, hn::Set(d, SunLattice::kLowest)), hn::Set(d, m_sweep.enough)),
                hn::Set(d, SunLattice::kOffset));
    constexpr int kShift = SunLattice::kMantissaShift;
    const VI rounded =
        hn::Add(hn::BitCast(di, shifted), hn::Set(di, (1 << (kShift - 1)) - SunLattice::kExponentBias));
    hn::StoreU(hn::DemoteTo(du16, hn::ShiftRight<kShift>(rounded)), du16, out);
  }

  static constexpr size_t kNodes = 729;
  static constexpr int32_t kLight = 0,
                           kDark = SunLattice::kPitch;  ///< offsets of bricks that many share

  const SunSweep& m_sweep;
  SunBricks& m_bricks;
  const BrickPyramid& m_pyramid;
  const EmptySpace m_empty;
  const Vec2i m_first, m_end;
  const int m_rows, m_columns;
  const size_t m_pitch;
  std::vector<float> m_tau;  ///< [level][u][v]: of the present cells; the sun's
                             ///< side at the last level
  std::vector<float> m_rho;  ///< densities of a row of lines, summed over steps
  DensityRows m_density;
  int m_lit_begin = 0, m_lit_end = 0;
};

inline void sweep_sun_bricks_impl(const SunSweep& sweep, const Vec2i& first, const Vec2i& end,
                                  SunBricks& bricks) {
  SunSweeper(sweep, first, end, bricks).run();
}

inline void sample_density_impl(const MarchGrid& grid, const Ray& local, double t0, double dt,
                                std::span<float> rho) {
  const GridReader reader(*grid.pyramid);
  const D d;
  const LinePath path(local.at(t0), dt * local.d);
  std::fill(rho.begin(), rho.end(), 0.0f);
  NodeWalker walker(*grid.pyramid, local,
                    clip_to_bounds(grid.bounds, local, {t0, t0 + dt * (double(rho.size()) - 1.0)}));
  NodeWalker::Stretch stretch;
  alignas(64) float some[kLanes];
  while (walker.next(stretch)) {
    if (stretch.range.hi == 0.0f) continue;
    const double first = std::ceil((stretch.t0 - t0) / dt), last = std::floor((stretch.t1 - t0) / dt);
    const size_t end = std::min(rho.size(), size_t(std::max(0.0, last)) + 1);
    for (size_t k = size_t(std::max(0.0, first)); k < end; k += kLanes) {
      const V at = hn::Iota(d, float(k));
      hn::Store(reader.template read<true>(path.at(0, at), path.at(1, at), path.at(2, at)), d, some);
      std::copy_n(some, std::min(kLanes, end - k), rho.data() + k);
    }
  }
}

inline double stepped_column_impl(const MarchGrid& grid, const Ray& local, double dt) {
  const GridReader reader(*grid.pyramid);
  const D d;
  const LinePath path(local.o, dt * local.d);
  NodeWalker walker(*grid.pyramid, local,
                    clip_to_bounds(grid.bounds, local, {0.0, std::numeric_limits<double>::infinity()}));
  NodeWalker::Stretch stretch;
  double sum = 0.0;
  while (walker.next(stretch)) {
    if (stretch.range.hi == 0.0f) continue;
    // Steps whose middle is in the stretch.
    const double first = std::ceil(stretch.t0 / dt - 0.5), end = std::ceil(stretch.t1 / dt - 0.5);
    V part = hn::Zero(d);
    for (double k = first; k < end; k += double(kLanes)) {
      const V at = hn::Iota(d, float(k + 0.5));
      const V rho = reader.template read<true>(path.at(0, at), path.at(1, at), path.at(2, at));
      part = hn::Add(part, hn::IfThenElseZero(hn::FirstN(d, size_t(std::min(double(kLanes), end - k))), rho));
    }
    sum += double(hn::GetLane(hn::SumOfLanes(d, part)));
  }
  return sum * dt;
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
