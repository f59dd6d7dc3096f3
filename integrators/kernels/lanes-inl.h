// Lanes that are samples along a ray: what happens between neighbours.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_LANES_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_LANES_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_LANES_INL_H
#endif

#include <cstdint>

#include "hwy/highway.h"

#include "integrators/kernels/readers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Moves lanes up by 1, 2, 4, ... places; what enters below comes from elsewhere. Everything stays in
/// registers: a vector stored and loaded again at another offset would wait for the store to reach the cache.
class LaneShifter {
 public:
  LaneShifter() {
    for (size_t k = 0; k < kSteps; ++k) {
      for (size_t i = 0; i < kLanes; ++i) m_from[k][i] = int32_t((i + kLanes - (size_t(1) << k)) % kLanes);
    }
  }

  /// Lane i of v goes to lane i + 2^k; the last ones come round to the front.
  HWY_INLINE V rotate(V v, size_t k) const {
    const D d;
    const DI di;
    return hn::TableLookupLanes(v, hn::IndicesFromVec(d, hn::Load(di, m_from[k])));
  }

  /// The same, with the front lanes taken from another rotated vector.
  HWY_INLINE V shift(V rotated, V front, size_t k) const {
    const D d;
    return hn::IfThenElse(hn::FirstN(d, size_t(1) << k), front, rotated);
  }

  /// Product of all lanes up to and including each.
  HWY_INLINE V running_product(V v) const {
    const D d;
    const V one = hn::Set(d, 1.0f);
    for (size_t k = 0; (size_t(1) << k) < kLanes; ++k) v = hn::Mul(v, shift(rotate(v, k), one, k));
    return v;
  }

 private:
  static constexpr size_t kSteps = 4;
  alignas(64) int32_t m_from[kSteps][kLanes];
};

/// Neighbouring samples of a quantity along a ray, across vectors.
class SampleHistory {
 public:
  void reset() {
    const D d;
    hn::Store(hn::Zero(d), d, m_rotated1);
    hn::Store(hn::Zero(d), d, m_rotated2);
  }

  /// The samples before those of v, and those before them.
  HWY_INLINE void push(const LaneShifter& lanes, V v, V& before1, V& before2) {
    const D d;
    const V r1 = lanes.rotate(v, 0), r2 = lanes.rotate(v, 1);
    before1 = lanes.shift(r1, hn::Load(d, m_rotated1), 0);
    before2 = lanes.shift(r2, hn::Load(d, m_rotated2), 1);
    hn::Store(r1, d, m_rotated1);
    hn::Store(r2, d, m_rotated2);
  }
  HWY_INLINE V push(const LaneShifter& lanes, V v) {
    const D d;
    const V r1 = lanes.rotate(v, 0), before = lanes.shift(r1, hn::Load(d, m_rotated1), 0);
    hn::Store(r1, d, m_rotated1);
    return before;
  }

 private:
  alignas(64) float m_rotated1[kLanes], m_rotated2[kLanes];
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
