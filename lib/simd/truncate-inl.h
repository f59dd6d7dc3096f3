// Per-target include guard, as Highway needs it.
#if defined(PILEUS_LIB_SIMD_TRUNCATE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_LIB_SIMD_TRUNCATE_INL_H
#undef PILEUS_LIB_SIMD_TRUNCATE_INL_H
#else
#define PILEUS_LIB_SIMD_TRUNCATE_INL_H
#endif

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Floats that are known to fit into 32 bits, rounded towards 0. Highway's ConvertTo also saturates those that
/// do not, which takes four instructions instead of one.
HWY_INLINE hn::Vec<hn::ScalableTag<int32_t>> truncate_small(hn::Vec<hn::ScalableTag<float>> v) {
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
  return {_mm512_cvttps_epi32(v.raw)};
#elif HWY_TARGET == HWY_AVX2
  return {_mm256_cvttps_epi32(v.raw)};
#elif HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_SSSE3
  return {_mm_cvttps_epi32(v.raw)};
#else
  return hn::ConvertTo(hn::ScalableTag<int32_t>(), v);
#endif
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
