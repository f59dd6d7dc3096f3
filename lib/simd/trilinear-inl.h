// Per-target include guard, as Highway needs it.
#if defined(PILEUS_LIB_SIMD_TRILINEAR_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_LIB_SIMD_TRILINEAR_INL_H
#undef PILEUS_LIB_SIMD_TRILINEAR_INL_H
#else
#define PILEUS_LIB_SIMD_TRILINEAR_INL_H
#endif

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Reads values[index] and values[index + 1] for every lane: one 64-bit gather per pair of corners instead of
/// two of 32 bits, because a gather costs by the element, not by the byte.
template <class D, class VI, class V = hn::Vec<D>>
HWY_INLINE void load_pairs(D d, const float* values, VI index, V& first, V& second) {
  const hn::RebindToSigned<D> di;
  const hn::Repartition<uint64_t, D> du64;
  const hn::RebindToSigned<decltype(du64)> di64;
  const hn::Half<decltype(di)> half;
  const auto* base = reinterpret_cast<const uint64_t*>(values);
  const auto lower = hn::ShiftLeft<2>(hn::PromoteTo(di64, hn::LowerHalf(half, index)));
  const auto upper = hn::ShiftLeft<2>(hn::PromoteTo(di64, hn::UpperHalf(half, index)));
  const V a = hn::BitCast(d, hn::GatherOffset(du64, base, lower));
  const V b = hn::BitCast(d, hn::GatherOffset(du64, base, upper));
  first = hn::ConcatEven(d, b, a);
  second = hn::ConcatOdd(d, b, a);
}

/// Trilinear interpolation in cells whose lowest corner is values[index], with neighbours at stride_x,
/// stride_y and 1.
///   x, y, z: position in the cell, [0, 1]
template <class D, class VI, class V = hn::Vec<D>>
HWY_INLINE V trilinear(D d, const float* values, VI index, int stride_x, int stride_y, V x, V y, V z) {
  const auto lerp = [](V a, V b, V s) HWY_ATTR { return hn::MulAdd(s, hn::Sub(b, a), a); };
  V lo, hi;
  load_pairs(d, values, index, lo, hi);
  const V c00 = lerp(lo, hi, z);
  load_pairs(d, values + stride_y, index, lo, hi);
  const V c01 = lerp(lo, hi, z);
  load_pairs(d, values + stride_x, index, lo, hi);
  const V c10 = lerp(lo, hi, z);
  load_pairs(d, values + stride_x + stride_y, index, lo, hi);
  const V c11 = lerp(lo, hi, z);
  return lerp(lerp(c00, c01, y), lerp(c10, c11, y), x);
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
