#pragma once

#include "integrators/kernels/march_kernel.h"
#include "integrators/lighting.h"
#include "integrators/march_packet.h"
#include "integrators/ray_fog.h"

namespace pileus {

/// How well a table stands for the fog along a ray.
struct MarchFogError {
  double transmittance = 0.0, light = 0.0;  ///< largest, light in any channel
};

/// Tables the fog of a ray where media may be met, as finely as it takes for both errors to stay below
/// `allowed`, within reason.
MarchFogError tabulate(const RayFog& fog, const Segment& media, double allowed, MarchFog& table);

/// Puts fog in front of what ray i of a packet ends with, and of its media.
///   allowed: error of the picture that tables may make
///   media:   how bright the media are without fog
/// Returns how bright they are through it.
double add_fog(const World& world, double allowed, double media, MarchPacket& packet, size_t i,
               TraceCounters& tile);

}  // namespace pileus
