// Per-target include guard, as Highway needs it.
#if defined(PILEUS_LIB_NOISE_KERNELS_GRADIENTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_LIB_NOISE_KERNELS_GRADIENTS_INL_H
#undef PILEUS_LIB_NOISE_KERNELS_GRADIENTS_INL_H
#else
#define PILEUS_LIB_NOISE_KERNELS_GRADIENTS_INL_H
#endif

#include <cstdint>

#include "hwy/highway.h"

#include "lib/noise/kernels/lattice_axis-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Twice the x, y and z component of the 16 gradients, as the highest byte of a float: 0x40 is 2, 0xC0 is -2.
HWY_ALIGN constexpr uint8_t kGradientBytes[3][16] = {
    {0x40, 0xC0, 0x40, 0xC0, 0x40, 0xC0, 0x40, 0xC0, 0, 0, 0, 0, 0x40, 0, 0xC0, 0},
    {0x40, 0x40, 0xC0, 0xC0, 0, 0, 0, 0, 0x40, 0xC0, 0x40, 0xC0, 0x40, 0xC0, 0x40, 0xC0},
    {0, 0, 0, 0, 0x40, 0x40, 0xC0, 0xC0, 0x40, 0x40, 0xC0, 0xC0, 0, 0x40, 0, 0xC0}};

using GradientPick = hn::Vec<hn::RebindToUnsigned<D>>;

/// What picks gradients: their numbers in the highest bytes; the others pick nothing.
HWY_INLINE GradientPick gradient_pick(GradientPick words) {
  return hn::Or(words, hn::Set(hn::RebindToUnsigned<D>(), 0x00808080u));
}
HWY_INLINE GradientPick gradient_pick(const uint8_t* numbers) {
  const hn::RebindToUnsigned<D> du;
  const hn::Rebind<uint8_t, D> du8;
  return gradient_pick(hn::ShiftLeft<24>(hn::PromoteTo(du, hn::LoadU(du8, numbers))));
}

/// Twice the gradients' component along an axis.
HWY_INLINE V doubled_gradient(int axis, GradientPick pick) {
  const hn::Repartition<uint8_t, D> du8;
  const auto table = hn::LoadDup128(du8, kGradientBytes[axis]);
  return hn::BitCast(D(), hn::TableLookupBytesOr0(table, hn::BitCast(du8, pick)));
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
