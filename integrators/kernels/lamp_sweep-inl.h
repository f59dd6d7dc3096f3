// The sweep that fills lattices of optical depth around a lamp.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_LAMP_SWEEP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_LAMP_SWEEP_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_LAMP_SWEEP_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_LAMP_SWEEP_INL_H
#endif

#include <algorithm>
#include <cstring>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/empty_space-inl.h"
#include "integrators/kernels/lattice_writer-inl.h"
#include "integrators/kernels/readers-inl.h"
#include "integrators/kernels/sun_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Sweeps the lines of some columns of bricks, and with them the lines beside, from the lamp outwards: eight
/// cells at a time, which then become bricks. Lanes are lines that are neighbours along v.
class LampSweeper {
 public:
  LampSweeper(const LampSweep& sweep, const Vec2i& first, const Vec2i& end, SunBricks& bricks)
      : m_sweep(sweep),
        m_bricks(bricks),
        m_writer(bricks, sweep.enough),
        m_reader(*sweep.grid->pyramid),
        m_empty(*sweep.grid->pyramid),
        m_first(first),
        m_end(end),
        m_rows((end.x - first.x) * kCells + 3),
        m_columns(((end.y - first.y) * kCells + 3 + int(kLanes) - 1) / int(kLanes) * int(kLanes)),
        m_pitch(size_t(m_columns) + kLanes),
        m_tau(size_t(kLevels) * size_t(m_rows) * m_pitch, 0.0f),
        m_scales(size_t(m_rows) * m_pitch, 0.0f) {
    find_scales();
  }

  void run() {
    sweep_levels(0, kFirst - 1, kFirst);
    extend_before_the_first();
    for (int bw = 0; bw < m_bricks.lattice->bricks.z; ++bw) {
      sweep_levels(bw, kFirst, kLevels);
      for (int bu = m_first.x; bu < m_end.x; ++bu) {
        for (int bv = m_first.y; bv < m_end.y; ++bv) store_brick({bu, bv, bw});
      }
      keep_last_levels();
    }
    m_bricks.samples += m_samples;
  }

 private:
  static constexpr int kCells = SunLattice::kBrickCells;
  static constexpr int kLevels = kCells + 3;  ///< level k holds the nodes at w = 8 bw - 1 + k
  static constexpr int kFirst = 3;            ///< those before come with the brick before

  float* row_at(int level, int row) {
    return m_tau.data() + (size_t(level) * size_t(m_rows) + size_t(row)) * m_pitch;
  }

  int u_of(int row) const { return m_first.x * kCells - 1 + row; }
  int first_v() const { return m_first.y * kCells - 1; }

  Vec3d towards(double u, double v) const { return m_sweep.ahead + u * m_sweep.eu + v * m_sweep.ev; }

  /// Optical depth of a sample of density 1 on each line.
  void find_scales() {
    const Affine world_from_local = m_sweep.grid->local_from_world.inverse();
    for (int row = 0; row < m_rows; ++row) {
      for (int column = 0; column < m_columns; ++column) {
        const double metres = length(world_from_local.direction(towards(u_of(row), first_v() + column)));
        m_scales[size_t(row) * m_pitch + size_t(column)] =
            float(m_sweep.grid->extinction * metres / m_sweep.steps);
      }
    }
  }

  /// Box around a part of the lattice.
  Box3d box_around(const Vec3d& lo, const Vec3d& hi) const {
    Box3d box;
    for (int n = 0; n < 8; ++n) {
      const Vec3d at(n & 1 ? hi.x : lo.x, n & 2 ? hi.y : lo.y, n & 4 ? hi.z : lo.z);
      box.extendBy(m_sweep.lamp + (m_sweep.w0 + at.z) * towards(at.x, at.y));
    }
    return box;
  }

  /// Levels [first, end) of all rows.
  void sweep_levels(int bw, int first, int end) {
    for (int row = 0; row < m_rows; ++row) {
      const double u = u_of(row), v = first_v(), w = bw * kCells - 2;
      const Box3d box = box_around(Vec3d(u, v, w + first), Vec3d(u, v + m_columns - 1, w + end));
      const bool is_empty = m_empty.holds(box, 0);
      for (int level = first; level < end; ++level) {
        if (is_empty || is_dark(row_at(level - 1, row))) {
          std::memcpy(row_at(level, row), row_at(level - 1, row), m_pitch * sizeof(float));
        } else {
          sweep_row(row, w + level, row_at(level - 1, row), row_at(level, row));
        }
      }
    }
  }

  bool is_dark(const float* tau) const {
    return std::all_of(tau, tau + m_columns, [&](float depth) { return depth >= m_sweep.enough; });
  }

  /// From the nodes of a row at w to the next.
  void sweep_row(int row, double w, const float* before, float* after) {
    const D d;
    const float* const scales = m_scales.data() + size_t(row) * m_pitch;
    std::copy_n(before, m_pitch, after);
    for (int step = 0; step < m_sweep.steps; ++step) {
      const double z = m_sweep.w0 + w + (step + 0.5) / m_sweep.steps;
      const Vec3d start = m_sweep.lamp + z * towards(u_of(row), first_v()), across = z * m_sweep.ev;
      const LinePath line(start, across);
      for (int column = 0; column < m_columns; column += int(kLanes)) {
        const V at = hn::Iota(d, float(column));
        const V rho = m_reader.read_or_skip(line.at(0, at), line.at(1, at), line.at(2, at));
        const V tau = hn::MulAdd(rho, hn::LoadU(d, scales + column), hn::LoadU(d, after + column));
        hn::StoreU(hn::Min(tau, hn::Set(d, m_sweep.enough)), d, after + column);
      }
      m_samples += uint64_t(m_columns);
    }
  }

  /// As if nothing bent there.
  void extend_before_the_first() {
    for (int row = 0; row < m_rows; ++row) {
      for (int column = 0; column < m_columns; ++column)
        row_at(0, row)[column] = 2.0f * row_at(1, row)[column] - row_at(2, row)[column];
    }
  }

  void keep_last_levels() {
    const size_t level = size_t(m_rows) * m_pitch;
    std::memmove(m_tau.data(), m_tau.data() + size_t(kCells) * level, 3 * level * sizeof(float));
  }

  void store_brick(const Vec3i& brick) {
    if (!is_wanted(brick)) return m_writer.skip(brick);
    alignas(64) uint16_t nodes[SunLattice::kPitch + 64];
    constexpr LatticeWriter::Balance kShares{1.0f / 12.0f, 1.0f / 12.0f};
    const int row0 = (brick.x - m_first.x) * kCells + 1, column0 = (brick.y - m_first.y) * kCells + 1;
    for (int u = 0; u <= kCells; ++u) {
      for (int w = 0; w <= kCells; ++w) {
        const auto row = [&](int level, int beside) { return row_at(level, row0 + u + beside) + column0; };
        m_writer.fill_row({row(w + 1, 0), row(w + 1, -1), row(w + 1, 1), row(w, 0), row(w + 2, 0)}, kShares,
                          nodes + u * SunLattice::kStrideU + w * SunLattice::kStrideW);
      }
    }
    m_writer.store(brick, nodes);
  }

  /// Whether there may be a density in the brick; rounding may move who reads it a little.
  bool is_wanted(const Vec3i& brick) const {
    if (m_sweep.is_everywhere) return true;
    constexpr double kMargin = 0.02;
    const Vec3d lo = Vec3d(brick * kCells) - Vec3d(kMargin);
    return !m_empty.holds(box_around(lo, lo + Vec3d(kCells + 2 * kMargin)), 0);
  }

  const LampSweep& m_sweep;
  SunBricks& m_bricks;
  LatticeWriter m_writer;
  const GridReader m_reader;
  const EmptySpace m_empty;
  const Vec2i m_first, m_end;
  const int m_rows, m_columns;
  const size_t m_pitch;
  std::vector<float> m_tau;     ///< [level][u][v]: of the present cells
  std::vector<float> m_scales;  ///< [u][v]
  uint64_t m_samples = 0;
};

inline void sweep_lamp_bricks_impl(const LampSweep& sweep, const Vec2i& first, const Vec2i& end,
                                   SunBricks& bricks) {
  LampSweeper(sweep, first, end, bricks).run();
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
