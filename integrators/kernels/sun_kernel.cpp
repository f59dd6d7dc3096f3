#include "integrators/kernels/sun_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "integrators/kernels/sun_kernel.cpp"
#include "hwy/foreach_target.h"  // compiles this file again for each target
#include "hwy/highway.h"

#include "integrators/kernels/lamp_sweep-inl.h"
#include "integrators/kernels/sun_lines-inl.h"
#include "integrators/kernels/sun_sweep-inl.h"

#if HWY_ONCE
namespace pileus {

HWY_EXPORT(sweep_sun_bricks_impl);
HWY_EXPORT(sweep_lamp_bricks_impl);
HWY_EXPORT(sum_sun_lines_impl);
HWY_EXPORT(sample_density_impl);
HWY_EXPORT(stepped_column_impl);

void sweep_sun_bricks(const SunSweep& sweep, const Vec2i& first, const Vec2i& end, SunBricks& bricks) {
  HWY_DYNAMIC_DISPATCH(sweep_sun_bricks_impl)(sweep, first, end, bricks);
}

void sweep_lamp_bricks(const LampSweep& sweep, const Vec2i& first, const Vec2i& end, SunBricks& bricks) {
  HWY_DYNAMIC_DISPATCH(sweep_lamp_bricks_impl)(sweep, first, end, bricks);
}

void sum_sun_lines(const SunSweep& sweep, const Vec3i& cell, int top, SunLines& lines) {
  HWY_DYNAMIC_DISPATCH(sum_sun_lines_impl)(sweep, cell, top, lines);
}

void sample_density(const MarchGrid& grid, const Ray& local, double t0, double dt, std::span<float> rho) {
  HWY_DYNAMIC_DISPATCH(sample_density_impl)(grid, local, t0, dt, rho);
}

double stepped_column(const MarchGrid& grid, const Ray& local, double dt, double end) {
  return HWY_DYNAMIC_DISPATCH(stepped_column_impl)(grid, local, dt, end);
}

}  // namespace pileus
#endif
