#include "integrators/sun_lattice.h"

#include <algorithm>
#include <cmath>

#include "lib/core/parallel.h"
#include "lib/math/trilinear.h"

namespace pileus {
namespace {

/// The frame of a lattice in the grid's local space.
SunSweep frame_of(const MarchGrid& grid, const Vec3d& wi_world, double spacing) {
  const Vec3d towards = grid.local_from_world.direction(wi_world);
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(towards[k]) > std::abs(towards[axis])) axis = k;
  }
  SunSweep sweep;
  sweep.grid = &grid;
  sweep.ew = towards * (spacing / std::abs(towards[axis]));
  sweep.length = spacing / std::abs(towards[axis]);
  sweep.steps = std::max(1, int(0.75 * spacing + 0.25));
  const Box3d& box = grid.bounds;
  const double slices = std::max(1.0, std::ceil((box.max[axis] - box.min[axis]) / spacing));
  sweep.size.z = int(slices) + 1;
  sweep.origin[axis] = towards[axis] > 0.0 ? box.min[axis] : box.max[axis];
  Vec3d* const across[2] = {&sweep.eu, &sweep.ev};
  int* const count[2] = {&sweep.size.x, &sweep.size.y};
  for (int i = 0; i < 2; ++i) {
    const int k = (axis + 1 + i) % 3;
    const double shift = slices * sweep.ew[k];  // how far lines move across the box
    const double lo = box.min[k] - std::max(0.0, shift), hi = box.max[k] - std::min(0.0, shift);
    *across[i] = Vec3d(0.0);
    (*across[i])[k] = spacing;
    sweep.origin[k] = lo - spacing;  // a line of zeros on either side
    *count[i] = int(std::ceil((hi - lo) / spacing)) + 3;
  }
  return sweep;
}

Affine lattice_from_local(const SunSweep& frame) {
  const Vec3d &u = frame.eu, &v = frame.ev, &w = frame.ew, &o = frame.origin;
  return Affine(Imath::M44d(u.x, u.y, u.z, 0, v.x, v.y, v.z, 0, w.x, w.y, w.z, 0, o.x, o.y, o.z, 1))
      .inverse();
}

/// Copies a row of lines, [v][w], and balances it: linear interpolation lies above a convex function by
/// h^2/12 of its second derivative on average. Node values lowered by as much, as their second differences
/// tell it, leave errors of changing sign, which cancel along a view ray (Blu, Thevenaz, Unser 2004). What
/// light meets at the edge of a cloud then becomes slightly negative: transmittance takes that as it is. More
/// than slightly is the sign of a lattice too coarse to be corrected, and would brighten: there is a floor.
///   before, after: the rows beside it; the row itself at the lattice's ends, where lines are zeros
void balance_row(const Vec3i& size, const float* before, const float* row, const float* after,
                 float* balanced) {
  constexpr float kMostLowered = 0.1f;
  const ptrdiff_t line = size.z;
  for (ptrdiff_t v = 0; v < size.y; ++v) {
    const ptrdiff_t at = v * line, lower = v == 0 ? 0 : -line, upper = v == size.y - 1 ? 0 : line;
    for (ptrdiff_t w = 0; w < line; ++w) {
      const ptrdiff_t i = at + w, back = w == 0 ? 0 : -1, on = w == line - 1 ? 0 : 1;
      const float across = (before[i] + after[i]) + (row[i + lower] + row[i + upper]) - 4.0f * row[i];
      const float along = back != 0 && on != 0 ? row[i - 1] + row[i + 1] - 2.0f * row[i] : 0.0f;
      balanced[i] = std::max(row[i] - (1.0f / 12.0f) * (across + along), -kMostLowered);
    }
  }
}

/// Fills rows [u0, u1) of a lattice, and for that sweeps their neighbours too.
void fill_rows(const SunSweep& frame, int u0, int u1, float* tau) {
  const int first = std::max(u0 - 1, 0), end = std::min(u1 + 1, frame.size.x);
  const size_t row = size_t(frame.size.y) * size_t(frame.size.z);
  const auto swept = std::make_unique_for_overwrite<float[]>(size_t(end - first) * row);
  sweep_sun_rows(frame, first, end, swept.get());
  for (int u = u0; u < u1; ++u) {
    const auto at = [&](int index) {
      return swept.get() + size_t(std::clamp(index, first, end - 1) - first) * row;
    };
    balance_row(frame.size, at(u - 1), at(u), at(u + 1), tau + size_t(u) * row);
  }
}

}  // namespace

double sun_lattice_nodes(const MarchGrid& grid, const Vec3d& wi_world, double spacing) {
  const SunSweep frame = frame_of(grid, wi_world, spacing);
  return double(frame.size.x) * frame.size.y * frame.size.z;
}

SunLattice build_sun_lattice(const MarchGrid& grid, const Vec3d& wi_world, double spacing) {
  const SunSweep frame = frame_of(grid, wi_world, spacing);
  SunLattice lattice;
  lattice.size = frame.size;
  lattice.lattice_from_world = lattice_from_local(frame) * grid.local_from_world;
  lattice.tau = make_large_array<float>(size_t(frame.size.x) * size_t(frame.size.y) * size_t(frame.size.z));
  constexpr int kRowsPerTask = 8;
  parallel_for(size_t((frame.size.x + kRowsPerTask - 1) / kRowsPerTask), [&](size_t task) {
    const int u0 = int(task) * kRowsPerTask;
    fill_rows(frame, u0, std::min(u0 + kRowsPerTask, frame.size.x), lattice.tau.get());
  });
  return lattice;
}

double sun_depth(const SunLattice& lattice, const Vec3d& p_world) {
  Vec3d p = lattice.lattice_from_world.point(p_world);
  Vec3i cell;
  for (int axis = 0; axis < 3; ++axis) {
    p[axis] = std::clamp(p[axis], 0.0, double(lattice.size[axis] - 1));
    cell[axis] = std::min(int(p[axis]), lattice.size[axis] - 2);
  }
  std::array<double, 8> corners;
  for (int n = 0; n < 8; ++n) {
    const size_t u = size_t(cell.x + (n & 1)), v = size_t(cell.y + (n >> 1 & 1)),
                 w = size_t(cell.z + (n >> 2));
    corners[size_t(n)] = double(lattice.tau[(u * size_t(lattice.size.y) + v) * size_t(lattice.size.z) + w]);
  }
  return trilinear(corners, p - Vec3d(cell));
}

}  // namespace pileus
