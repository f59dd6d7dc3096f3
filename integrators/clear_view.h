#pragma once

#include <span>

#include "integrators/kernels/march_kernel.h"
#include "lib/math/beam.h"
#include "lib/scene/world.h"

namespace pileus {

/// Which blocks of neighbouring rays, in Morton order, meet no medium: certain, but not complete. All rays
/// are asked about as one beam first, and grids node by node, in nodes about as large as the beam is wide, so
/// that many rays that pass beside a cloud cost a few looks. Hazes, and grids in many places, are where their
/// bounds are. (Single packets find out for themselves as they march: asked here they would cost more than
/// they save.)
///   media: of the scene, numbered as there
///   clear: [block of kClearRays]; at most kMostClear
void find_clear(const MarchScene& scene, std::span<const WorldMedium* const> media, std::span<const Ray> rays,
                std::span<char> clear);

/// Whether none of the rays of a beam meets a medium: certain where true.
bool is_clear(const MarchScene& scene, std::span<const WorldMedium* const> media, const Beam& beam);

inline constexpr size_t kClearRays = 4 * kPacketRays, kMostClear = 4;

}  // namespace pileus
