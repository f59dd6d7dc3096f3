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
  sweep.steps = std::max(1, int(std::lround(spacing)));
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

/// Linear interpolation lies above a convex function by h^2/12 of its second derivative on average. Node
/// values lowered by as much, as their second differences tell it, leave errors of changing sign, which
/// cancel along a view ray (Blu, Thevenaz, Unser 2004). What light meets at the edge of a cloud then becomes
/// slightly negative: transmittance takes that as it is. More than slightly is the sign of a lattice too
/// coarse to be corrected, and would brighten: there is a floor.
constexpr float kMostLowered = 0.1f;

std::unique_ptr<float[]> balance(const Vec3i& size, const float* tau) {
  const size_t su = size_t(size.y) * size_t(size.z), sv = size_t(size.z);
  auto balanced = std::make_unique_for_overwrite<float[]>(size_t(size.x) * su);
  parallel_for(size_t(size.x), [&](size_t u) {
    // The border lines are zeros, or go on as they are.
    const ptrdiff_t before_u = u == 0 ? 0 : -ptrdiff_t(su),
                    after_u = int(u) == size.x - 1 ? 0 : ptrdiff_t(su);
    for (size_t v = 0; v < size_t(size.y); ++v) {
      const ptrdiff_t before_v = v == 0 ? 0 : -ptrdiff_t(sv),
                      after_v = int(v) == size.y - 1 ? 0 : ptrdiff_t(sv);
      const float* line = tau + u * su + v * sv;
      float* out = balanced.get() + u * su + v * sv;
      const auto across = [&](size_t w) {
        const float* at = line + w;
        return (at[before_u] + at[after_u]) + (at[before_v] + at[after_v]) - 4.0f * at[0];
      };
      const size_t last = sv - 1;
      const auto floored = [](float depth) { return std::max(depth, -kMostLowered); };
      out[0] = floored(line[0] - (1.0f / 12.0f) * across(0));
      for (size_t w = 1; w < last; ++w) {
        out[w] =
            floored(line[w] - (1.0f / 12.0f) * (across(w) + (line[w - 1] + line[w + 1] - 2.0f * line[w])));
      }
      out[last] = floored(line[last] - (1.0f / 12.0f) * across(last));
    }
  });
  return balanced;
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
  lattice.tau = std::make_unique_for_overwrite<float[]>(size_t(frame.size.x) * size_t(frame.size.y) *
                                                        size_t(frame.size.z));
  parallel_for(size_t(frame.size.x),
               [&](size_t u) { sweep_sun_rows(frame, int(u), int(u) + 1, lattice.tau.get()); });
  lattice.tau = balance(lattice.size, lattice.tau.get());
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
