#include "tests/simd/math_kernels.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/simd/math_kernels.cpp"
#include "hwy/foreach_target.h"  // compiles this file again for each target
#include "hwy/highway.h"

#include "lib/simd/exponential-inl.h"
#include "lib/simd/trilinear-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;
constexpr size_t kLanes = hn::MaxLanes(D());

/// A vector of source[at ...]; behind its end stands its last value.
template <class T>
hn::Vec<hn::Rebind<T, D>> load(std::span<const T> source, size_t at) {
  alignas(64) T lanes[kLanes];
  for (size_t i = 0; i < kLanes; ++i) lanes[i] = source[std::min(at + i, source.size() - 1)];
  return hn::Load(hn::Rebind<T, D>(), lanes);
}

void store(V value, std::span<float> result, size_t at) {
  alignas(64) float lanes[kLanes];
  hn::Store(value, D(), lanes);
  for (size_t i = 0; i < kLanes && at + i < result.size(); ++i) result[at + i] = lanes[i];
}

void transmittances_impl(std::span<const float> tau, std::span<float> result) {
  for (size_t i = 0; i < tau.size(); i += kLanes) store(simd_transmittance(D(), load(tau, i)), result, i);
}

void opacities_impl(std::span<const float> tau, std::span<float> result) {
  for (size_t i = 0; i < tau.size(); i += kLanes) store(simd_opacity(D(), load(tau, i)), result, i);
}

void trilinears_impl(const float* values, std::span<const int32_t> index, std::span<const float> x,
                     std::span<const float> y, std::span<const float> z, std::span<float> result) {
  for (size_t i = 0; i < index.size(); i += kLanes) {
    store(trilinear(D(), values, load(index, i), 81, 9, load(x, i), load(y, i), load(z, i)), result, i);
  }
}

void quantized_trilinears_impl(const int16_t* values, std::span<const int32_t> index,
                               std::span<const float> x, std::span<const float> y, std::span<const float> z,
                               std::span<float> result) {
  const D d;
  for (size_t i = 0; i < index.size(); i += kLanes) {
    const int16_t* at[kLanes];
    for (size_t k = 0; k < kLanes; ++k) at[k] = values + index[std::min(i + k, index.size() - 1)];
    const V steps = trilinear_quantized(d, at, 81, 9, load(x, i), load(y, i), load(z, i));
    store(hn::Mul(steps, hn::Set(d, 1.0f / kQuantizedStep)), result, i);
  }
}

const char* target_impl() {
  return hwy::TargetName(HWY_TARGET);
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pileus {

HWY_EXPORT(transmittances_impl);
HWY_EXPORT(opacities_impl);
HWY_EXPORT(trilinears_impl);
HWY_EXPORT(quantized_trilinears_impl);
HWY_EXPORT(target_impl);

void transmittances(std::span<const float> tau, std::span<float> result) {
  HWY_DYNAMIC_DISPATCH(transmittances_impl)(tau, result);
}

void opacities(std::span<const float> tau, std::span<float> result) {
  HWY_DYNAMIC_DISPATCH(opacities_impl)(tau, result);
}

void trilinears(const float* values, std::span<const int32_t> index, std::span<const float> x,
                std::span<const float> y, std::span<const float> z, std::span<float> result) {
  HWY_DYNAMIC_DISPATCH(trilinears_impl)(values, index, x, y, z, result);
}

void quantized_trilinears(const int16_t* values, std::span<const int32_t> index, std::span<const float> x,
                          std::span<const float> y, std::span<const float> z, std::span<float> result) {
  HWY_DYNAMIC_DISPATCH(quantized_trilinears_impl)(values, index, x, y, z, result);
}

const char* math_target() {
  return HWY_DYNAMIC_DISPATCH(target_impl)();
}

}  // namespace pileus
#endif
