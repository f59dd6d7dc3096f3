#include "integrators/march_packet.h"

#include <array>

namespace pileus {
namespace {

void count_marched(std::span<const MarchResult> marched, MarchPacket& packet) {
  for (const MarchResult& result : marched) {
    packet.samples += result.samples;
    packet.lookups += result.lookups;
    packet.leaps += result.leaps;
  }
}

/// False where all of the rays [first, end) are good.
bool refine_once(const MarchScene& scene, double allowed, size_t first, size_t end, MarchPacket& packet) {
  std::array<size_t, kPacketRays> chosen;
  std::array<MarchRay, kPacketRays> jobs;
  size_t count = 0;
  for (size_t i = first; i < end; ++i) {
    const double error = packet.marched[i].error;
    if (!(error > allowed)) continue;
    packet.jobs[i].step_quality *= std::clamp(0.7 * allowed / error, 0.05, 0.5);
    chosen[count] = i;
    jobs[count++] = packet.jobs[i];
  }
  if (count == 0) return false;
  std::array<MarchResult, kPacketRays> marched;
  std::vector<double> sums(count * packet.stride);
  march_rays(scene, std::span(jobs).first(count), std::span(marched).first(count), sums);
  count_marched(std::span(marched).first(count), packet);
  for (size_t n = 0; n < count; ++n) {
    packet.marched[chosen[n]] = marched[n];
    std::copy_n(sums.begin() + std::ptrdiff_t(n * packet.stride), packet.stride,
                packet.sums.begin() + std::ptrdiff_t(chosen[n] * packet.stride));
  }
  return true;
}

}  // namespace

void MarchPacket::find_hits(const World& world, std::span<const RaySight> seen, bool are_neighbours) {
  std::vector<double> clear;
  if (are_neighbours && !rays.empty()) clear_distances(world, rays, seen.front(), clear);
  nearest_surfaces(world, rays, seen, clear, hits);
}

void march_packet(const MarchScene& scene, MarchPacket& packet) {
  march_rays(scene, packet.jobs, packet.marched, packet.sums);
  count_marched(packet.marched, packet);
}

void refine_packet(const MarchScene& scene, double allowed, MarchPacket& packet) {
  constexpr int kRounds = 3;
  for (size_t first = 0; first < packet.jobs.size(); first += kPacketRays) {
    const size_t end = std::min(first + kPacketRays, packet.jobs.size());
    for (int round = 0; round < kRounds; ++round)
      if (!refine_once(scene, allowed, first, end, packet)) break;
  }
}

}  // namespace pileus
