#include "integrators/kernels/march_kernel.h"

#include <algorithm>

#include "lib/core/build_features.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "integrators/kernels/march_kernel.cpp"
#include "hwy/foreach_target.h"  // compiles this file again for each target
#include "hwy/highway.h"

#include "integrators/kernels/marcher-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {

/// Those packets that solids may shade, or those that none does.
enum class Packets { open, shaded };

template <int kGrids, int kLights, bool kPlain>
void march_with(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
                std::span<double> sums, Packets which = Packets::open) {
  Marcher<kGrids, kLights, kPlain> marcher(scene);
  const size_t stride = scene.media() * sums_per_medium(scene);
  for (size_t first = 0; first < rays.size(); first += kPacketRays) {
    if ((rays[first].lit != nullptr) != (which == Packets::shaded)) continue;
    const size_t count = std::min(kPacketRays, rays.size() - first);
    marcher.march(rays.subspan(first, count), results.subspan(first, count), sums.data() + first * stride);
  }
}

/// Chooses the loop that has what the scene calls for and no more.
void march_rays_impl(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
                     std::span<double> sums) {
  const bool has_shades = std::any_of(rays.begin(), rays.end(), [](const MarchRay& ray) { return ray.lit; });
  if (has_shades) march_with<0, -1, false>(scene, rays, results, sums, Packets::shaded);
  const bool is_plain = !scene.several_terms && !scene.height_light;
  const bool is_simple = scene.grids.size() == 1 && scene.hazes.empty() && scene.places.empty() &&
                         scene.lamps.empty() && scene.grids[0].extinction > 0.0 &&
                         !(scene.shadow_step > 0.0) && !rays.front().fog;
  if constexpr (kHasSeveralMedia) {
    if (!is_simple) return march_with<0, -1, false>(scene, rays, results, sums);
  }
  if (!is_plain) return march_with<1, -1, false>(scene, rays, results, sums);
  if constexpr (kHasShadows) {
    if (scene.lights == 1) return march_with<1, 1, true>(scene, rays, results, sums);
    if (scene.lights > 1) return march_with<1, -1, true>(scene, rays, results, sums);
  }
  march_with<1, 0, true>(scene, rays, results, sums);
}

const char* target_impl() {
  return hwy::TargetName(HWY_TARGET);
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pileus {

HWY_EXPORT(march_rays_impl);
HWY_EXPORT(target_impl);

void march_rays(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
                std::span<double> sums) {
  HWY_DYNAMIC_DISPATCH(march_rays_impl)(scene, rays, results, sums);
}

const char* march_target() {
  return HWY_DYNAMIC_DISPATCH(target_impl)();
}

}  // namespace pileus
#endif
