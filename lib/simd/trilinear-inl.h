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

/// The four edges of a cell along its last axis.
template <class DI>
struct CellEdges {
  hn::Vec<DI> words[4];  ///< [dx][dy]: both ends of an edge, the lower one in the lower half
};

/// The 32 bits at at[i], and there + stride_y, + stride_x and + both, for every lane i, wherever that is. Loads
/// of single words, because a hardware gather costs more than these on many processors: twice as much on Zen 3
/// and a quarter more on Zen 4. All words of four lanes together: their addresses then stay in registers.
template <class DI>
HWY_INLINE CellEdges<DI> load_edges(DI di, const int16_t* const* at, ptrdiff_t stride_x, ptrdiff_t stride_y) {
  CellEdges<DI> edges;
  if constexpr (hn::MaxLanes(di) > 4) {
    const hn::Half<DI> half;
    const auto lower = load_edges(half, at, stride_x, stride_y),
               upper = load_edges(half, at + hn::MaxLanes(half), stride_x, stride_y);
    for (int n = 0; n < 4; ++n) edges.words[n] = hn::Combine(di, upper.words[n], lower.words[n]);
  } else {
    const int16_t* const lanes[4] = {at[0], at[1], at[2], at[3]};
    for (int n = 0; n < 4; ++n) {
      const ptrdiff_t offset = (n & 1 ? stride_y : 0) + (n & 2 ? stride_x : 0);
      const auto word = [&](size_t i) HWY_ATTR {
        int32_t bits;
        std::memcpy(&bits, lanes[i] + offset, sizeof(bits));
        return bits;
      };
#if HWY_ARCH_X86
      edges.words[n] = hn::Vec<DI>{_mm_set_epi32(word(3), word(2), word(1), word(0))};
#else
      alignas(16) const int32_t words[4] = {word(0), word(1), word(2), word(3)};
      edges.words[n] = hn::Load(di, words);
#endif
    }
  }
  return edges;
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
  const auto edges = load_edges(di, at, stride_x, stride_y);
  const auto along_z = [&](int edge) HWY_ATTR {
    const auto pairs = hn::BitCast(di16, edges.words[edge]);
    VI odd = hn::Zero(di);
    const VI even = hn::ReorderWidenMulAccumulate(di, pairs, weights, hn::Set(di, 32768 * kOne), odd);
    return hn::ConvertTo(d, hn::RearrangeToOddPlusEven(even, odd));
  };
  const auto lerp = [](V a, V b, V s) HWY_ATTR { return hn::MulAdd(s, hn::Sub(b, a), a); };
  return lerp(lerp(along_z(0), along_z(1), y), lerp(along_z(2), along_z(3), y), x);
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
