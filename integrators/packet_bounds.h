#pragma once

#include <span>

#include "integrators/march_packet.h"
#include "integrators/ray_enclosure.h"
#include "lib/scene/integrator.h"

namespace pileus {

/// Proves how far the results of all rays of a packet may be off, and says so in them. What rays that go on
/// from the ends of these may be off has to be known before.
///   fog:           of the world
///   narrow_enough: what a bound may be too large by
void prove_bounds(const EnclosedWorld& enclosed, const FogSetup& fog, double narrow_enough,
                  MarchPacket& packet, std::span<RayResult> results);

/// What rays that go on from the ends of a packet may be off is what these ends may be off.
///   on, seen: the packet of those rays, and their results
void add_bounds(const MarchPacket& on, const SecondaryRays& next, std::span<const RayResult> seen,
                MarchPacket& packet);

}  // namespace pileus
