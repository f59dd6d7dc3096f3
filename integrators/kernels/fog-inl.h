// Fog in front of the media, on the rays of a packet.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_FOG_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_FOG_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_FOG_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_FOG_INL_H
#endif

#include <algorithm>
#include <array>
#include <span>

#include "hwy/highway.h"

#include "integrators/kernels/packet-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// What fog makes of the steps of a packet, read from the tables of its rays.
class PacketFog {
 public:
  /// t of the steps counts from `base`; lanes beyond the rays repeat the last.
  void begin(std::span<const MarchRay> rays, double base) {
    m_any = rays[0].fog != nullptr;
    if (!m_any) return;
    m_base = base;
    for (size_t i = 0; i < kPacketRays; ++i) m_tables[i] = rays[std::min(i, rays.size() - 1)].fog;
    for (PacketFloats& sum : m_light) sum.fill(0.0f);
  }

  /// False where there is no fog.
  bool any() const { return m_any; }

  /// Looks at the middle of a step of the rays of one vector.
  void look(size_t v, V t) {
    alignas(64) float middles[kLanes];
    hn::Store(t, D(), middles);
    for (size_t i = 0; i < kLanes; ++i) {
      const size_t lane = v * kLanes + i;
      const MarchFog& table = *m_tables[lane];
      const double x = (m_base + double(middles[i]) - table.t0) * table.nodes_per_metre;
      const double within = std::clamp(x, 0.0, double(table.nodes.size() - 1));
      const size_t node = std::min(size_t(within), table.nodes.size() - 2);
      const float share = float(within - double(node));
      for (size_t k = 0; k < 4; ++k) {
        const float near = table.nodes[node][k], far = table.nodes[node + 1][k];
        m_here[k].of[lane] = near + share * (far - near);
      }
    }
  }

  /// Share of the light of the step looked at that passes.
  V passed(size_t v) const { return m_here[0].get(v); }

  /// The strongest channel of the light of the fog in front of it.
  V brightest(size_t v) const {
    return hn::Max(m_here[1].get(v), hn::Max(m_here[2].get(v), m_here[3].get(v)));
  }

  /// Adds the fog in front of what the step hides of all behind it.
  ///   hidden: transmittance before the step less that behind it
  void add(size_t v, V hidden) {
    for (size_t k = 0; k < 3; ++k) m_light[k].add(v, hn::Mul(hidden, m_here[k + 1].get(v)));
  }

  void tell(size_t ray, MarchFog& fog) const {
    for (size_t k = 0; k < 3; ++k) fog.light[int(k)] = double(m_light[k].of[ray]);
  }

 private:
  bool m_any = false;
  double m_base = 0.0;
  std::array<const MarchFog*, kPacketRays> m_tables{};
  std::array<PacketFloats, 4> m_here;   ///< transmittance, and the light in three channels
  std::array<PacketFloats, 3> m_light;  ///< sums along the rays
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
