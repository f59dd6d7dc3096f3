#pragma once

#include <cstdint>
#include <functional>

#include "integrators/kernels/march_kernel.h"
#include "integrators/kernels/sun_kernel.h"

namespace pileus {

// Optical depth towards a sun, stored where it varies slowly.
//
// The lattice is sheared: w runs towards the sun along the grid's axis that is nearest to that direction, u
// and v along the other two. Every line of nodes along w is then a line of light, and one sweep sums the
// optical depth along it without ever interpolating what it has summed: sweeps from slice to slice blur the
// shadow a little at each step. A point outside the grid on the dark side reads the end of its line, one
// beside it the lines of zeros around.

/// How far nodes are apart [cells]. Across the light, what all of a column varies adds up; along it the depth
/// bends only by how the density varies, so that nodes may stand further apart there.
struct LatticeSpacing {
  double across = 1.0, along = 1.0;
};

struct LatticeOptions {
  LatticeSpacing spacing;
  float enough = SunLattice::kDeepest;  ///< depths beyond this count as this
  bool is_everywhere = true;            ///< false: only where the grid has a density of its own
  double most_bytes = 512e6;
};

/// About how much memory a lattice would take.
double sun_lattice_bytes(const MarchGrid& grid, const Vec3d& wi_world, const LatticeOptions& options);

/// The lattice of a grid for light from wi_world; one without bricks where it does not fit in its memory.
/// Uses parallel_for. Samples lie as close along the light as lines do across it.
///   samples: how many densities were read
SunLattice build_sun_lattice(const MarchGrid& grid, const Vec3d& wi_world, const LatticeOptions& options,
                             uint64_t* samples = nullptr);

/// The lattice's optical depth at a point: the kernels' interpolation, in double.
double sun_depth(const SunLattice& lattice, const Vec3d& p_world);

/// What the lattice would say, which is not built: a point takes as long as some hundred nodes. Only for
/// lattices whose lines are so close that they read values.
class SunProbe {
 public:
  static constexpr double kCoarsest = 3.0;  ///< spacing across [cells], exclusive

  /// The grid outlives it.
  SunProbe(const MarchGrid& grid, const Vec3d& wi_world, const LatticeOptions& options);

  /// sun_depth() but for what the rounding of nodes changes.
  double depth(const Vec3d& p_world) const;

 private:
  SunSweep m_sweep;
  Affine m_lattice_from_world;
  Vec3i m_cells{0, 0, 0};
};

// What lattices of all lights have in common.

inline constexpr double brick_bytes() {
  return SunLattice::kPitch * sizeof(uint16_t);
}

/// Bricks that stand for those of a table that meet one of the grid's that is not empty: those bricks'
/// volume, and a layer of half a brick around it where they are as scattered as in a ball.
double bricks_with_density(const MarchGrid& grid, const LatticeOptions& options);

/// From the space in which a lattice has this origin and these edges to (u, v, w).
Affine lattice_from_local(const Vec3d& o, const Vec3d& u, const Vec3d& v, const Vec3d& w);

/// Fills the bricks [first, end) of u and v, and all of w.
using SweepBricks = std::function<void(const Vec2i& first, const Vec2i& end, SunBricks& bricks)>;

/// A lattice of so many bricks, as a sweep fills them; one without bricks where it does not fit in its
/// memory. Uses parallel_for.
SunLattice fill_lattice(const Affine& lattice_from_world, const double (&count)[3], float enough,
                        double most_bytes, const SweepBricks& sweep, uint64_t* samples = nullptr);

/// Optical depth at (u, v, w): the kernels' interpolation, in double.
double depth_at(const SunLattice& lattice, const Vec3d& p_lattice);

}  // namespace pileus
