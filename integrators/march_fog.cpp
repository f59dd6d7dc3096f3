#include "integrators/march_fog.h"

#include <algorithm>
#include <cmath>

namespace pileus {
namespace {

double largest(const Rgb& rgb) {
  return std::max({rgb.x, rgb.y, rgb.z});
}

std::array<float, 4> node_of(const Veil& veil) {
  return {float(veil.transmittance), float(veil.light.x), float(veil.light.y), float(veil.light.z)};
}

/// Between two nodes the table is linear: it errs most about halfway, where the fog is smooth.
void compare_halfway(const MarchFog& table, size_t node, const std::array<float, 4>& fog,
                     MarchFogError& most) {
  const auto error = [&](size_t k) {
    return std::abs(0.5 * (double(table.nodes[node][k]) + double(table.nodes[node + 1][k])) - double(fog[k]));
  };
  most.transmittance = std::max(most.transmittance, error(0));
  most.light = std::max({most.light, error(1), error(2), error(3)});
}

}  // namespace

MarchFogError tabulate(const RayFog& fog, const Segment& media, double allowed, MarchFog& table) {
  constexpr size_t kFewest = 4, kMost = 1024;
  table.light = Rgb(0.0);
  table.t0 = media.t0;
  table.nodes.clear();
  for (size_t k = 0; k <= kFewest; ++k) {
    table.nodes.push_back(node_of(fog.to(media.t0 + media.length() * double(k) / double(kFewest))));
  }
  for (;;) {
    const size_t parts = table.nodes.size() - 1;
    table.nodes_per_metre = double(parts) / media.length();
    MarchFogError error;
    std::vector<std::array<float, 4>> finer(2 * parts + 1);
    for (size_t k = 0; k < parts; ++k) {
      finer[2 * k] = table.nodes[k];
      finer[2 * k + 1] = node_of(fog.to(media.t0 + media.length() * (double(k) + 0.5) / double(parts)));
      compare_halfway(table, k, finer[2 * k + 1], error);
    }
    finer.back() = table.nodes.back();
    if (std::max(error.transmittance, error.light) <= allowed || parts >= kMost) return error;
    table.nodes = std::move(finer);
  }
}

double add_fog(const World& world, double allowed, double media, MarchPacket& packet, size_t i,
               TraceCounters& tile) {
  MarchRay& job = packet.jobs[i];
  packet.fog->build(job.ray, job.segment.t1, packet.are_from_camera);
  const Veil end = packet.fog->end();
  packet.behind[i] = end.over(packet.behind[i]);
  packet.fog_ends[i] = end.transmittance;
  const Segment inside = media_range(world, job.ray, job.segment);
  MarchFog& table = packet.fogs[i];
  const MarchFogError error = tabulate(*packet.fog, inside.empty() ? Segment{0.0, 1.0} : inside,
                                       allowed / std::max(1.0, media), table);
  packet.fog_errors[i] = error.transmittance * media + error.light;
  job.fog = &table;
  tile.fog_veils += 1 + 2 * table.nodes.size();
  return media + largest(end.light);
}

}  // namespace pileus
