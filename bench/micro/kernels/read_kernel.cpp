#include "bench/micro/kernels/read_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/micro/kernels/read_kernel.cpp"
#include "hwy/foreach_target.h"  // compiles this file again for each target
#include "hwy/highway.h"

#include "integrators/kernels/readers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {

float sum_densities_impl(const BrickPyramid& pyramid, const bench::Positions& at) {
  const D d;
  const GridReader reader(pyramid);
  V sum = hn::Zero(d);
  for (size_t i = 0; i + kLanes <= at.x.size(); i += kLanes) {
    sum = hn::Add(sum,
                  reader.read<false>(hn::LoadU(d, &at.x[i]), hn::LoadU(d, &at.y[i]), hn::LoadU(d, &at.z[i])));
  }
  return hn::GetLane(hn::SumOfLanes(d, sum));
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pileus {

HWY_EXPORT(sum_densities_impl);

float bench::sum_densities(const BrickPyramid& pyramid, const Positions& at) {
  return HWY_DYNAMIC_DISPATCH(sum_densities_impl)(pyramid, at);
}

}  // namespace pileus
#endif
