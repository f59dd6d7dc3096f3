// Rays as lanes: what a packet keeps of each.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_PACKET_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_PACKET_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_PACKET_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_PACKET_INL_H
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "hwy/highway.h"

#include "integrators/kernels/readers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

static_assert(kPacketRays % kLanes == 0);
constexpr size_t kVectors = kPacketRays / kLanes;  ///< of a packet

/// A number per ray of a packet.
struct alignas(64) PacketFloats {
  float of[kPacketRays];

  HWY_INLINE V get(size_t vector) const { return hn::Load(D(), of + vector * kLanes); }
  HWY_INLINE void set(size_t vector, V value) { hn::Store(value, D(), of + vector * kLanes); }
  HWY_INLINE void add(size_t vector, V value) { set(vector, hn::Add(get(vector), value)); }
  void fill(float value) { std::fill_n(of, kPacketRays, value); }
};

/// Sums of many floats without the drift of a plain sum (METHODS §1.4): what each addition loses is kept.
struct CompensatedFloats {
  PacketFloats sum, lost;

  void reset() {
    sum.fill(0.0f);
    lost.fill(0.0f);
  }
  HWY_INLINE void add(size_t vector, V value) {
    const V before = sum.get(vector), after = hn::Add(before, value), added = hn::Sub(after, before);
    const V error = hn::Add(hn::Sub(before, hn::Sub(after, added)), hn::Sub(value, added));
    sum.set(vector, after);
    lost.set(vector, hn::Add(lost.get(vector), error));
  }
  HWY_INLINE V get(size_t vector) const { return hn::Add(sum.get(vector), lost.get(vector)); }
  double of(size_t ray) const { return double(sum.of[ray]) + double(lost.of[ray]); }
};

/// The rays of a packet in some space: o + t * d.
struct PacketPath {
  PacketFloats o[3], d[3];

  void set(size_t ray, const Vec3d& origin, const Vec3d& direction) {
    for (int axis = 0; axis < 3; ++axis) {
      o[axis].of[ray] = float(origin[axis]);
      d[axis].of[ray] = float(direction[axis]);
    }
  }
  HWY_INLINE V at(int axis, size_t vector, V t) const {
    return hn::MulAdd(t, d[axis].get(vector), o[axis].get(vector));
  }
};

/// The stretches that are asked for, on the rays of a packet.
struct PacketSegments {
  PacketFloats start, end;

  /// t of the steps counts from `base`.
  void set(size_t ray, const Segment& segment, double base) {
    start.of[ray] = float(segment.t0 - base);
    end.of[ray] = float(std::min(segment.t1 - base, double(std::numeric_limits<float>::max())));
  }
  /// The part of a step that lies in each ray's own stretch: its middle and its length.
  HWY_INLINE void cut(size_t v, V begin, V step, V& t, V& dt) const {
    const D d;
    const V from = hn::Max(begin, start.get(v)), to = hn::Min(hn::Add(begin, step), end.get(v));
    dt = hn::Max(hn::Sub(to, from), hn::Zero(d));
    t = hn::MulAdd(dt, hn::Set(d, 0.5f), from);
  }
};

/// Depths of one ray; only where a picture shows them.
struct RayDepths {
  Segment first{0.0, std::numeric_limits<double>::infinity()};  ///< see MarchResult
  double half = std::numeric_limits<double>::infinity();

  /// A step and the transmittance before and after it.
  void note(float t, float dt, float rho, float tau, float before, float after) {
    if (!std::isfinite(first.t1)) (rho > 0.0f ? first.t1 : first.t0) = double(t);
    if (before < 0.5f || after >= 0.5f || std::isfinite(half)) return;
    // Inside its step the density is taken as constant.
    const double share = std::clamp(std::log(2.0 * double(before)) / double(tau), 0.0, 1.0);
    half = double(t) + (share - 0.5) * double(dt);
  }
};

/// The same of the rays of a packet.
struct PacketDepths {
  std::array<RayDepths, kPacketRays> of;

  void note(size_t vector, V t, V dt, V rho, V tau, V before, V after) {
    const D d;
    alignas(64) float ts[kLanes], dts[kLanes], rhos[kLanes], taus[kLanes], befores[kLanes], afters[kLanes];
    hn::Store(t, d, ts), hn::Store(dt, d, dts), hn::Store(rho, d, rhos), hn::Store(tau, d, taus);
    hn::Store(before, d, befores), hn::Store(after, d, afters);
    for (size_t i = 0; i < kLanes; ++i)
      of[vector * kLanes + i].note(ts[i], dts[i], rhos[i], taus[i], befores[i], afters[i]);
  }

  /// Writes those of a ray, whose t count from `base`, into its result.
  void tell(size_t ray, double base, MarchResult& result) const {
    const RayDepths& depths = of[ray];
    if (std::isfinite(depths.first.t1)) result.first = {base + depths.first.t0, base + depths.first.t1};
    result.z_half = base + depths.half;
  }
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
