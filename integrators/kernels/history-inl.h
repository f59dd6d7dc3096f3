// The samples that came before, on the rays of a packet: what errors are told by.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_HISTORY_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_HISTORY_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_HISTORY_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_HISTORY_INL_H
#endif

#include "hwy/highway.h"

#include "integrators/kernels/packet-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// A step of every ray of a vector.
struct Sample {
  V sigma;   ///< extinction [1/m]
  V lit;     ///< radiance added per metre without anything in front
  V bright;  ///< radiance of the medium where it is opaque
  V after;   ///< transmittance behind the step
};

/// The error of the midpoint rule is h^2/24 of the second derivative: differences of neighbouring samples
/// measure it, in the lit density and, for the effect of a wrong optical depth on what lies behind, in the
/// density. Errors of different steps are added like independent ones.
struct History {
  V lit1, lit2, sigma1, sigma2, bright1, weight1;

  /// 24^2 times the squared error of the last sample, now that the next one is known.
  ///   behind: radiance from the end of the ray
  HWY_INLINE V error2(V lit, V sigma, V behind) const {
    const V second_lit = second_difference(lit, lit1, lit2),
            second_sigma = second_difference(sigma, sigma1, sigma2);
    const V e = hn::Mul(weight1, hn::MulAdd(hn::Max(bright1, behind), second_sigma, second_lit));
    return hn::Mul(e, e);
  }

  ///   weight: transmittance before the sample times its length
  HWY_INLINE void push(const Sample& sample, V weight) {
    lit2 = lit1, lit1 = sample.lit;
    sigma2 = sigma1, sigma1 = sample.sigma;
    bright1 = sample.bright;
    weight1 = weight;
  }

 private:
  static HWY_INLINE V second_difference(V now, V middle, V first) {
    return hn::Abs(hn::Sub(hn::Add(first, now), hn::Add(middle, middle)));
  }
};

/// The histories of a packet, as they wait for its next step.
struct PacketHistory {
  PacketFloats lit1, lit2, sigma1, sigma2, bright1, weight1;

  void reset() {
    for (PacketFloats* past : {&lit1, &lit2, &sigma1, &sigma2, &bright1, &weight1}) past->fill(0.0f);
  }
  HWY_INLINE History get(size_t v) const {
    return {lit1.get(v), lit2.get(v), sigma1.get(v), sigma2.get(v), bright1.get(v), weight1.get(v)};
  }
  HWY_INLINE void set(size_t v, const History& history) {
    lit1.set(v, history.lit1), lit2.set(v, history.lit2);
    sigma1.set(v, history.sigma1), sigma2.set(v, history.sigma2);
    bright1.set(v, history.bright1), weight1.set(v, history.weight1);
  }
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
