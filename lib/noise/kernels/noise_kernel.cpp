#include "lib/noise/kernels/noise_kernel.h"

#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/noise/kernels/noise_kernel.cpp"
#include "hwy/foreach_target.h"  // compiles this file again for each target
#include "hwy/highway.h"

#include "lib/noise/kernels/noise_points-inl.h"
#include "lib/noise/kernels/noise_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {

/// Chooses the loops of a kind: call(std::integral_constant<OctaveSum, kind>).
template <class Call>
void with_kind(OctaveSum kind, const Call& call) {
  switch (kind) {
    case OctaveSum::fbm:
      return call(std::integral_constant<OctaveSum, OctaveSum::fbm>());
    case OctaveSum::billow:
      return call(std::integral_constant<OctaveSum, OctaveSum::billow>());
    case OctaveSum::ridged:
      return call(std::integral_constant<OctaveSum, OctaveSum::ridged>());
  }
}

void sum_block_impl(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                    const NoiseBlock& block, std::span<float> values, std::span<Vec3f> gradients) {
  with_kind(kind, [&](auto k) HWY_ATTR {
    if (gradients.empty()) {
      sum_block<k()>(tables, octaves, block, values.data());
    } else {
      sum_block<k()>(tables, octaves, block, values.data(), gradients.data());
    }
  });
}

void sum_points_impl(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                     std::span<const Vec3d> points, std::span<float> values, std::span<Vec3f> gradients) {
  with_kind(kind, [&](auto k) HWY_ATTR {
    if (gradients.empty()) {
      sum_points<k(), false>(tables, octaves, points, values.data(), nullptr);
    } else {
      sum_points<k(), true>(tables, octaves, points, values.data(), gradients.data());
    }
  });
}

void bound_cubes_impl(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                      const NoiseBlock& centres, std::span<float> lo, std::span<float> hi) {
  with_kind(kind, [&](auto k) HWY_ATTR { bound_cubes<k()>(tables, octaves, centres, lo.data(), hi.data()); });
}

const char* noise_target_impl() {
  return hwy::TargetName(HWY_TARGET);
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pileus {

HWY_EXPORT(sum_block_impl);
HWY_EXPORT(sum_points_impl);
HWY_EXPORT(bound_cubes_impl);
HWY_EXPORT(noise_target_impl);

void sum_octaves(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                 const NoiseBlock& block, std::span<float> values, std::span<Vec3f> gradients) {
  HWY_DYNAMIC_DISPATCH(sum_block_impl)
  (kind, tables, octaves, block, values, gradients);
}

void sum_octaves(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                 std::span<const Vec3d> points, std::span<float> values, std::span<Vec3f> gradients) {
  HWY_DYNAMIC_DISPATCH(sum_points_impl)
  (kind, tables, octaves, points, values, gradients);
}

void bound_octaves(OctaveSum kind, const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                   const NoiseBlock& centres, std::span<float> lo, std::span<float> hi) {
  HWY_DYNAMIC_DISPATCH(bound_cubes_impl)
  (kind, tables, octaves, centres, lo, hi);
}

const char* noise_target() {
  return HWY_DYNAMIC_DISPATCH(noise_target_impl)();
}

}  // namespace pileus
#endif
