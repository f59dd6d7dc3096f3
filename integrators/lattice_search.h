#pragma once

#include <functional>

#include "integrators/sun_pilots.h"
#include "integrators/sunlight.h"

namespace pileus {

/// Forgets lattices that were not good enough.
void clear_lattices(MarchWorld& march);

/// Fills march.kernel.lattices and the faces of lamps with lattices that are good enough, and not much
/// better; false where memory ends first. See SunlightChoice, of which it tells spacing, error and reason.
///   trace: makes pilots with so many points on a ray
bool find_lattices(const std::function<Pilots(int points)>& trace, double tolerance, double most_bytes,
                   MarchWorld& march, SunlightChoice& choice);

}  // namespace pileus
