// The sweep that fills lattices of optical depth.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_SUN_SWEEP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_SUN_SWEEP_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_SUN_SWEEP_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_SUN_SWEEP_INL_H
#endif

#include <algorithm>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/readers-inl.h"
#include "integrators/kernels/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Optical depth of every piece between neighbouring nodes of one line, then summed from the sun's side.
inline void sweep_line(const SunSweep& sweep, const GridReader& reader, const Vec3d& start,
                       std::vector<float>& pieces, float* tau) {
  const int nodes = sweep.size.z, count = (nodes - 1) * sweep.steps;
  std::fill(pieces.begin(), pieces.end(), 0.0f);
  const Ray ray{start, sweep.ew};
  const D d;
  const LinePath path(start, sweep.ew);
  const float scale = float(sweep.grid->extinction * sweep.length / sweep.steps);
  NodeWalker walker(*sweep.grid->pyramid, ray,
                    clip_to_bounds(sweep.grid->bounds, ray, {0.0, double(nodes - 1)}));
  NodeWalker::Stretch stretch;
  const V per_step = hn::Set(d, 1.0f / float(sweep.steps));
  int done = 0;
  while (walker.next(stretch)) {
    if (stretch.range.hi == 0.0f) continue;
    const int first = std::max(done, int(stretch.t0 * sweep.steps - 0.5)),
              last = std::min(count, int(stretch.t1 * sweep.steps + 0.5));
    // A whole vector may reach beyond the stretch: what it reads there is right, too.
    int k = first;
    for (; k < last; k += int(kLanes)) {
      const V w = hn::Mul(hn::Add(hn::Iota(d, 0.5f), hn::Set(d, float(k))), per_step);
      const V rho = reader.template read<true>(path.at(0, w), path.at(1, w), path.at(2, w));
      hn::StoreU(hn::Mul(rho, hn::Set(d, scale)), d, pieces.data() + k);
    }
    done = std::max(done, std::min(k, count));
  }
  if (done == 0) {
    std::fill_n(tau, nodes, 0.0f);
    return;
  }
  std::fill(pieces.begin() + done, pieces.end(), 0.0f);
  float sum = 0.0f;
  tau[nodes - 1] = 0.0f;
  for (int w = nodes - 2, k = count - 1; w >= 0; --w) {
    for (int step = 0; step < sweep.steps; ++step, --k) sum += pieces[size_t(k)];
    tau[w] = sum;
  }
}

inline void sweep_sun_rows_impl(const SunSweep& sweep, int u0, int u1, float* tau) {
  const GridReader reader(*sweep.grid->pyramid);
  std::vector<float> pieces(size_t(sweep.size.z * sweep.steps) + kLanes);
  for (int u = u0; u < u1; ++u) {
    for (int v = 0; v < sweep.size.y; ++v) {
      const Vec3d start = sweep.origin + double(u) * sweep.eu + double(v) * sweep.ev;
      sweep_line(sweep, reader, start, pieces,
                 tau + (size_t(u - u0) * size_t(sweep.size.y) + size_t(v)) * size_t(sweep.size.z));
    }
  }
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
