#pragma once

#include "integrators/kernels/march_kernel.h"

namespace pileus {

// Optical depth towards a sun, stored where it varies slowly.
//
// The lattice is sheared: w runs towards the sun along the grid's axis that is nearest to that direction, u
// and v along the other two. Every line of nodes along w is then a line of light, and one sweep sums the
// optical depth along it without ever interpolating what it has summed: sweeps from slice to slice blur the
// shadow a little at each step. A point outside the grid on the dark side reads the end of its line, one
// beside it the lines of zeros around.

/// Nodes that build_sun_lattice would make.
double sun_lattice_nodes(const MarchGrid& grid, const Vec3d& wi_world, double spacing);

/// The lattice of a grid for light from wi_world. Uses parallel_for.
///   spacing: of the nodes [cells]; between nodes lie about three samples per four cells
SunLattice build_sun_lattice(const MarchGrid& grid, const Vec3d& wi_world, double spacing);

/// The lattice's optical depth at a point: the kernels' interpolation, in double.
double sun_depth(const SunLattice& lattice, const Vec3d& p_world);

}  // namespace pileus
