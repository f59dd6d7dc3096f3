#include "integrators/packet_bounds.h"

#include <algorithm>

#include "lib/math/absolute.h"

namespace pileus {

void prove_bounds(const EnclosedWorld& enclosed, const FogSetup& setup, double narrow_enough,
                  MarchPacket& packet, std::span<RayResult> results) {
  const bool has_fog = packet.fog.has_value();
  RayEnclosure enclosure(enclosed);
  RayFog fog(setup);
  const RayEnclosure::Goal goal{narrow_enough};
  for (size_t i = 0; i < results.size(); ++i) {
    const Ray& ray = packet.rays[i];
    const Segment segment = packet.jobs[i].segment;
    EnclosedRgb behind{packet.behind[i], Rgb(0.0)};
    if (has_fog) fog.build(ray, segment.t1, packet.are_from_camera);
    if (!packet.behind_bound.empty())
      behind.half = Rgb(packet.behind_bound[i] * (has_fog ? packet.fog_ends[i] : 1.0));
    const Rgb& estimate = results[i].radiance;
    results[i].bound = error_bound(
        enclosure.enclose(ray, segment, behind, estimate, goal, has_fog ? &fog : nullptr), estimate);
  }
  packet.bound_samples += enclosure.counters.density_samples;
  packet.bound_lookups += enclosure.depth_lookups;
}

void add_bounds(const MarchPacket& on, const SecondaryRays& next, std::span<const RayResult> seen,
                MarchPacket& packet) {
  packet.behind_bound.resize(packet.rays.size());
  for (size_t n = 0; n < seen.size(); ++n) {
    const Rgb weight = absolute(next.weights[n]);
    packet.behind_bound[next.parents[n]] += std::max({weight.x, weight.y, weight.z}) * seen[n].bound;
  }
  packet.bound_samples += on.bound_samples;
  packet.bound_lookups += on.bound_lookups;
}

}  // namespace pileus
