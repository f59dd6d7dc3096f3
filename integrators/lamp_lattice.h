#pragma once

#include <cstdint>
#include <vector>

#include "integrators/kernels/march_kernel.h"
#include "integrators/sun_lattice.h"

namespace pileus {

// Optical depth from a lamp, stored where it varies slowly.
//
// As a sun's lattice (sun_lattice.h), but its lines of nodes meet in the lamp: w counts along a direction
// away from it, u and v are what lines are apart by perspective. Every line is summed once. Where the lamp
// stands well outside a grid, one face looks at all of it; else the faces of a cube around the lamp, along
// the grid's axes, share the directions. Spacings hold where the lines are furthest apart.

/// About how much memory the faces of a grid would take.
double lamp_faces_bytes(const MarchGrid& grid, const Vec3d& lamp_world, const LatticeOptions& options);

/// The faces of a grid; `fits` becomes false where they do not fit in their memory. Uses parallel_for.
///   samples: how many densities were read
std::vector<LampFace> build_lamp_faces(const MarchGrid& grid, const Vec3d& lamp_world,
                                       const LatticeOptions& options, bool& fits,
                                       uint64_t* samples = nullptr);

/// Their optical depth at a point: the kernels' interpolation, in double.
double lamp_depth(const std::vector<LampFace>& faces, const Vec3d& p_world);

}  // namespace pileus
