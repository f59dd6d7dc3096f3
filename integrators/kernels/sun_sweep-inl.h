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
#include "integrators/kernels/empty_space-inl.h"
#include "integrators/kernels/lattice_writer-inl.h"
#include "integrators/kernels/readers-inl.h"
#include "integrators/kernels/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Sweeps the lines of some columns of bricks, and with them the lines beside,
/// from the sun's side down: eight cells at a time, which then become bricks.
/// Lanes are lines that are neighbours along v.
class SunSweeper {
 public:
  SunSweeper(const SunSweep& sweep, const Vec2i& first, const Vec2i& end, SunBricks& bricks)
      : m_sweep(sweep),
        m_bricks(bricks),
        m_writer(bricks, sweep.enough),
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
    if (!is_wanted(brick)) return m_writer.skip(brick);
    alignas(64) uint16_t nodes[SunLattice::kPitch + 64];
    fill_nodes(brick, nodes);
    m_writer.store(brick, nodes);
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

  void fill_nodes(const Vec3i& brick, uint16_t* nodes) {
    const LatticeWriter::Balance shares{balance(m_sweep.ev), balance(m_sweep.ew)};
    const int row0 = (brick.x - m_first.x) * kCells + 1, column0 = (brick.y - m_first.y) * kCells + 1;
    for (int u = 0; u <= kCells; ++u) {
      for (int w = 0; w <= kCells; ++w) {
        const auto row = [&](int level, int beside) { return row_at(level, row0 + u + beside) + column0; };
        m_writer.fill_row({row(w + 1, 0), row(w + 1, -1), row(w + 1, 1), row(w, 0), row(w + 2, 0)}, shares,
                          nodes + u * SunLattice::kStrideU + w * SunLattice::kStrideW);
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

  const SunSweep& m_sweep;
  SunBricks& m_bricks;
  LatticeWriter m_writer;
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

inline double stepped_column_impl(const MarchGrid& grid, const Ray& local, double dt, double end_of_ray) {
  const GridReader reader(*grid.pyramid);
  const D d;
  const LinePath path(local.o, dt * local.d);
  NodeWalker walker(*grid.pyramid, local, clip_to_bounds(grid.bounds, local, {0.0, end_of_ray}));
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
