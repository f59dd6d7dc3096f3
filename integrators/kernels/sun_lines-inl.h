// Optical depths on a few lines of a lattice that is not built.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_SUN_LINES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_SUN_LINES_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_SUN_LINES_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_SUN_LINES_INL_H
#endif

#include <array>

#include "hwy/highway.h"

#include "integrators/kernels/readers-inl.h"
#include "integrators/kernels/sun_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// A vector of the lines around a cell, summed from there towards the sun.
class LineVector {
 public:
  LineVector(const SunSweep& sweep, const Vec3i& cell, size_t first)
      : m_reader(*sweep.grid->pyramid),
        m_steps(sweep.steps),
        m_scale(hn::Set(D(), float(sweep.grid->extinction * sweep.length / sweep.steps))),
        m_enough(hn::Set(D(), sweep.enough)) {
    alignas(64) float o[3][kLanes];
    for (size_t i = 0; i < kLanes; ++i) {
      const Vec3d node(cell + SunLines::line(first + i) - Vec3i(0, 0, 1));
      const Vec3d p = sweep.origin + node.x * sweep.eu + node.y * sweep.ev + node.z * sweep.ew;
      for (int axis = 0; axis < 3; ++axis) o[axis][i] = float(p[axis]);
    }
    for (int axis = 0; axis < 3; ++axis) {
      m_o[axis] = hn::Load(D(), o[axis]);
      m_d[axis] = float(sweep.ew[axis] / sweep.steps);
    }
  }

  /// Depth of a cell of every line, `level` cells from where they begin.
  V cell(int level) const {
    const D d;
    V sum = hn::Zero(d);
    for (int step = 0; step < m_steps; ++step) {
      const V t = hn::Set(d, float(level * m_steps + step) + 0.5f);
      const auto at = [&](int axis) HWY_ATTR { return hn::MulAdd(t, hn::Set(d, m_d[axis]), m_o[axis]); };
      sum = hn::Add(sum, m_reader.read_or_skip(at(0), at(1), at(2)));
    }
    return hn::Mul(sum, m_scale);
  }

  /// That of all cells [level, end), as far as it is not deep enough before.
  V cells(int level, int end) const {
    const D d;
    V sum = hn::Zero(d);
    for (; level < end && !hn::AllTrue(d, hn::Ge(sum, m_enough)); ++level) sum = hn::Add(sum, cell(level));
    return sum;
  }

  V limit(V tau) const { return hn::Min(tau, m_enough); }

 private:
  const GridReader m_reader;
  const int m_steps;
  const V m_scale, m_enough;
  V m_o[3];
  float m_d[3];
};

inline void sum_sun_lines_impl(const SunSweep& sweep, const Vec3i& cell, int top, SunLines& lines) {
  constexpr int kLevels = int(SunLines::kLevels);
  for (size_t first = 0; first < SunLines::kLines; first += kLanes) {
    const LineVector some(sweep, cell, first);
    V tau = some.limit(some.cells(kLevels - 1, top - (cell.z - 1)));
    for (int level = kLevels - 1; level >= 0; --level) {
      hn::Store(tau, D(), lines.depths[size_t(level)].data() + first);
      if (level > 0) tau = some.limit(hn::Add(tau, some.cell(level - 1)));
    }
  }
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
