// Per-target include guard, as Highway needs it.
#if defined(PILEUS_LIB_SIMD_TRILINEAR_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_LIB_SIMD_TRILINEAR_INL_H
#undef PILEUS_LIB_SIMD_TRILINEAR_INL_H
#else
#define PILEUS_LIB_SIMD_TRILINEAR_INL_H
#endif

#include <cstddef>
#include <cstdint>
#include <cstring>

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

/// The 32 bits at at[i] + offset for every lane i, wherever that is. Loads of single words, because a
/// hardware gather costs more than these on many processors: twice as much on Zen 3.
template <class DI>
HWY_INLINE hn::Vec<DI> load_words(DI di, const int16_t* const* at, ptrdiff_t offset) {
  if constexpr (hn::MaxLanes(di) > 4) {
    const hn::Half<DI> half;
    const size_t middle = hn::MaxLanes(half);
    return hn::Combine(di, load_words(half, at + middle, offset), load_words(half, at, offset));
  } else {
    const auto word = [&](size_t i) HWY_ATTR {
      int32_t bits;
      std::memcpy(&bits, at[i] + offset, sizeof(bits));
      return bits;
    };
#if HWY_ARCH_X86
    return hn::Vec<DI>{_mm_set_epi32(word(3), word(2), word(1), word(0))};
#else
    alignas(16) int32_t words[hn::MaxLanes(di)];
    for (size_t i = 0; i < hn::MaxLanes(di); ++i) words[i] = word(i);
    return hn::Load(di, words);
#endif
  }
}

/// What trilinear_quantized yields for a q of 1.
constexpr float kQuantizedStep = 32767.0f;

/// Trilinear interpolation of 16-bit values q >= 0, stored as q - 32768: kQuantizedStep times the
/// interpolated q. The lowest corner of lane i's cell is at[i][0], with neighbours at stride_x, stride_y
/// and 1. Along the last axis two products of 16 bits do what takes six instructions otherwise, with the
/// position rounded to 1/32767 of a cell.
///   x, y, z: position in the cell, [0, 1]
template <class D, class V = hn::Vec<D>>
HWY_INLINE V trilinear_quantized(D d, const int16_t* const* at, int stride_x, int stride_y, V x, V y, V z) {
  const hn::RebindToSigned<D> di;
  const hn::Repartition<int16_t, D> di16;
  using VI = hn::Vec<decltype(di)>;
  constexpr int kOne = 32767;
  const VI upper = hn::NearestInt(hn::Mul(z, hn::Set(d, float(kOne))));
  const VI lower = hn::Sub(hn::Set(di, kOne), upper);
  const auto weights = hn::BitCast(di16, hn::Or(hn::ShiftLeft<16>(upper), lower));
  const auto along_z = [&](ptrdiff_t offset) HWY_ATTR {
    const auto pairs = hn::BitCast(di16, load_words(di, at, offset));
    VI odd = hn::Zero(di);
    const VI even = hn::ReorderWidenMulAccumulate(di, pairs, weights, hn::Set(di, 32768 * kOne), odd);
    return hn::ConvertTo(d, hn::RearrangeToOddPlusEven(even, odd));
  };
  const auto lerp = [](V a, V b, V s) HWY_ATTR { return hn::MulAdd(s, hn::Sub(b, a), a); };
  return lerp(lerp(along_z(0), along_z(stride_y), y),
              lerp(along_z(stride_x), along_z(stride_x + stride_y), y), x);
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
