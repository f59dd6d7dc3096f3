// Per-target include guard, as Highway needs it.
#if defined(PILEUS_LIB_SIMD_EXPONENTIAL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_LIB_SIMD_EXPONENTIAL_INL_H
#undef PILEUS_LIB_SIMD_EXPONENTIAL_INL_H
#else
#define PILEUS_LIB_SIMD_EXPONENTIAL_INL_H
#endif

#include "hwy/highway.h"

#include "lib/simd/truncate-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// exp(-tau) = 2^n (1 + p): n <= 0 an integer as a power of two, p = e^f - 1 with |f| <= ln(2)/2.
template <class V>
struct ReducedExponential {
  V power, p;
};

/// tau > -80: those of balanced lattices are slightly negative. Beyond 87, where exp(-tau) leaves the normal
/// floats, it counts as 87. Taylor polynomial of degree 7 for e^f - 1: its relative error is below 2^-24 on
/// the reduced interval.
template <class D, class V = hn::Vec<D>>
HWY_INLINE ReducedExponential<V> reduced_exponential(D d, V tau) {
  const hn::RebindToSigned<D> di;
  const V x = hn::Min(tau, hn::Set(d, 87.0f));
  const V n = hn::Round(hn::Mul(x, hn::Set(d, -1.44269504f)));
  // f = -x - n ln 2, with ln 2 in two parts so that the difference is exact.
  const V f =
      hn::NegMulAdd(n, hn::Set(d, -2.12194440e-4f), hn::NegMulAdd(n, hn::Set(d, 0.693359375f), hn::Neg(x)));
  V p = hn::Set(d, 1.0f / 5040.0f);
  p = hn::MulAdd(p, f, hn::Set(d, 1.0f / 720.0f));
  p = hn::MulAdd(p, f, hn::Set(d, 1.0f / 120.0f));
  p = hn::MulAdd(p, f, hn::Set(d, 1.0f / 24.0f));
  p = hn::MulAdd(p, f, hn::Set(d, 1.0f / 6.0f));
  p = hn::MulAdd(p, f, hn::Set(d, 0.5f));
  p = hn::MulAdd(hn::Mul(p, f), f, f);
  const auto exponent = hn::Add(truncate_small(n), hn::Set(di, 127));
  return {hn::BitCast(d, hn::ShiftLeft<23>(exponent)), p};
}

/// exp(-tau) for tau > -80, to 2 ulp; 1.6e-38 beyond tau = 87.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V simd_transmittance(D d, V tau) {
  const auto e = reduced_exponential(d, tau);
  return hn::MulAdd(e.power, e.p, e.power);
}

/// 1 - exp(-tau) for tau > -80, to 3 ulp however small tau is.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V simd_opacity(D d, V tau) {
  const auto e = reduced_exponential(d, tau);
  return hn::NegMulAdd(e.power, e.p, hn::Sub(hn::Set(d, 1.0f), e.power));
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
