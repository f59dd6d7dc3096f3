#pragma once

#include "integrators/kernels/march_lamp.h"
#include "lib/scene/phase_function.h"

namespace pileus {

/// The table of a phase function: as many nodes as it takes to err by less than 5e-5 of each value, or 2^16.
PhaseTable phase_table(const PhaseFunction& phase);

/// Value at s, as the kernels read it.
double phase_at(const PhaseTable& table, double s);

/// The s of a scattering angle, from the directions to the viewer and to the light, unit vectors.
double phase_coordinate(const Vec3d& wo, const Vec3d& wi);

}  // namespace pileus
