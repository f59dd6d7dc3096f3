#include "lib/noise/kernels/noise_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/noise/kernels/noise_kernel.cpp"
#include "hwy/foreach_target.h"  // compiles this file again for each target
#include "hwy/highway.h"

#include "lib/noise/kernels/noise_block-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {

void sum_octaves_impl(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                      const NoiseBlock& block, std::span<float> values) {
  switch (kind) {
    case OctaveSum::fbm:
      return sum_block<OctaveSum::fbm>(tables, octaves, block, values.data());
    case OctaveSum::billow:
      return sum_block<OctaveSum::billow>(tables, octaves, block, values.data());
    case OctaveSum::ridged:
      return sum_block<OctaveSum::ridged>(tables, octaves, block, values.data());
  }
}

const char* noise_target_impl() {
  return hwy::TargetName(HWY_TARGET);
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pileus {

HWY_EXPORT(sum_octaves_impl);
HWY_EXPORT(noise_target_impl);

void sum_octaves(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                 const NoiseBlock& block, std::span<float> values) {
  HWY_DYNAMIC_DISPATCH(sum_octaves_impl)(kind, tables, octaves, block, values);
}

const char* noise_target() {
  return HWY_DYNAMIC_DISPATCH(noise_target_impl)();
}

}  // namespace pileus
#endif
