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

MarchFogError largest(const MarchFogError& a, const MarchFogError& b) {
  return {std::max(a.transmittance, b.transmittance), std::max(a.light, b.light)};
}

/// Between two nodes the table is linear: it errs most about halfway, where the fog is smooth.
MarchFogError error_halfway(const MarchFog& table, size_t node, const std::array<float, 4>& fog) {
  const auto error = [&](size_t k) {
    return std::abs(0.5 * (double(table.nodes[node][k]) + double(table.nodes[node + 1][k])) - double(fog[k]));
  };
  return {error(0), std::max({error(1), error(2), error(3)})};
}

std::array<float, 4> middle(const std::array<float, 4>& a, const std::array<float, 4>& b) {
  std::array<float, 4> result;
  for (size_t k = 0; k < result.size(); ++k) result[k] = 0.5f * (a[k] + b[k]);
  return result;
}

}  // namespace

/// Halves all parts of the table until they are good enough. Kernels want nodes in equal distances; but the
/// fog is asked only for those in parts that are not yet good by far, or have an edge of some fog in them:
/// the others stay on their line.
MarchFogError tabulate(const RayFog& fog, const Segment& media, double allowed, MarchFog& table) {
  constexpr size_t kFewest = 4, kMost = 1024;
  constexpr double kGoodByFar = 0.25;
  const std::vector<double> edges = fog.edges();
  table.light = Rgb(0.0);
  table.t0 = media.t0;
  table.nodes.clear();
  for (size_t k = 0; k <= kFewest; ++k) {
    table.nodes.push_back(node_of(fog.to(media.t0 + media.length() * double(k) / double(kFewest))));
  }
  std::vector<char> is_open(kFewest, 1);
  MarchFogError of_closed;
  for (;;) {
    const size_t parts = is_open.size();
    const double width = media.length() / double(parts);
    table.nodes_per_metre = double(parts) / media.length();
    MarchFogError error = of_closed;
    std::vector<std::array<float, 4>> finer(2 * parts + 1);
    std::vector<char> finer_open(2 * parts, 0);
    for (size_t k = 0; k < parts; ++k) {
      finer[2 * k] = table.nodes[k];
      if (!is_open[k]) {
        finer[2 * k + 1] = middle(table.nodes[k], table.nodes[k + 1]);
        continue;
      }
      const double t0 = media.t0 + double(k) * width;
      finer[2 * k + 1] = node_of(fog.to(t0 + 0.5 * width));
      const MarchFogError own = error_halfway(table, k, finer[2 * k + 1]);
      error = largest(error, own);
      const bool has_edge = std::any_of(edges.begin(), edges.end(),
                                        [&](double edge) { return edge > t0 && edge < t0 + width; });
      if (has_edge || std::max(own.transmittance, own.light) > kGoodByFar * allowed) {
        finer_open[2 * k] = finer_open[2 * k + 1] = 1;
      } else {
        of_closed = largest(of_closed, own);
      }
    }
    finer.back() = table.nodes.back();
    if (std::max(error.transmittance, error.light) <= allowed || parts >= kMost) return error;
    table.nodes = std::move(finer);
    is_open = std::move(finer_open);
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
