// Shadows of solids in the media, on the rays of a packet.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_SHADES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_SHADES_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_SHADES_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_SHADES_INL_H
#endif

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/packet-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// How much of each step the suns light past the solids. Steps come in order.
class Shades {
 public:
  explicit Shades(int lights) : m_lights(size_t(lights)) {}

  /// t of the steps counts from `base`; lanes beyond the rays repeat the last.
  void begin(std::span<const MarchRay> rays, double base) {
    m_any = rays[0].lit != nullptr;
    if (!m_any) return;
    m_base = base;
    for (size_t l = 0; l < m_lights.size(); ++l) {
      for (size_t i = 0; i < kPacketRays; ++i)
        m_lights[l].left[i] = rays[std::min(i, rays.size() - 1)].lit[l];
    }
  }

  /// False where no solid shades any of the rays.
  bool any() const { return m_any; }

  /// Looks at a step of the rays of one vector.
  void look(size_t v, V t, V dt) {
    const D d;
    alignas(64) float middles[kLanes], lengths[kLanes];
    hn::Store(t, d, middles), hn::Store(dt, d, lengths);
    m_uneven.set(v, hn::Zero(d));
    for (Light& light : m_lights) {
      for (size_t i = 0; i < kLanes; ++i) {
        const double middle = m_base + double(middles[i]), half = 0.5 * double(lengths[i]);
        light.share.of[v * kLanes + i] = share(light.left[v * kLanes + i], {middle - half, middle + half});
      }
      const V lit = light.share.get(v);
      m_uneven.set(v, hn::Max(m_uneven.get(v), hn::Mul(lit, hn::Sub(hn::Set(d, 1.0f), lit))));
    }
  }

  /// The lit share of the step looked at.
  V share(int light, size_t v) const { return m_lights[size_t(light)].share.get(v); }

  /// What it errs by, squared, where an edge lies in it: what is lit may be the near part or the far one,
  /// which differ by what the step itself dims and by how its light changes.
  ///   weight: transmittance before it times its length
  V error2(size_t v, V weight, V tau, V lit, V lit_before) const {
    const V differ = hn::MulAdd(tau, lit, hn::Abs(hn::Sub(lit, lit_before)));
    const V error = hn::Mul(hn::Mul(m_uneven.get(v), weight), differ);
    return hn::Mul(error, error);
  }

 private:
  struct Light {
    std::array<std::span<const Segment>, kPacketRays> left;  ///< stretches that do not end before the step
    PacketFloats share;
  };

  static float share(std::span<const Segment>& left, const Segment& step) {
    while (!left.empty() && left.front().t1 <= step.t0) left = left.subspan(1);
    double lit = 0.0;
    for (const Segment& stretch : left) {
      if (stretch.t0 >= step.t1) break;
      lit += std::min(stretch.t1, step.t1) - std::max(stretch.t0, step.t0);
    }
    return step.empty() ? 0.0f : float(std::min(lit / step.length(), 1.0));
  }

  std::vector<Light> m_lights;
  PacketFloats m_uneven;  ///< share * (1 - share), of the light where it is largest
  double m_base = 0.0;
  bool m_any = false;
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
