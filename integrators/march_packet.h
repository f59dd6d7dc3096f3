#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "integrators/haze_rays.h"
#include "integrators/kernels/march_kernel.h"
#include "integrators/march_scene.h"
#include "integrators/ray_ends.h"
#include "integrators/ray_fog.h"
#include "lib/core/build_features.h"
#include "lib/scene/world.h"

namespace pileus {

/// The rays of one call and what becomes of them.
struct MarchPacket {
  MarchPacket(std::span<const Ray> all, const MarchWorld& march, bool has_surfaces, bool has_shades = false)
      : rays(all),
        jobs(all.size()),
        marched(all.size()),
        hits(has_surfaces ? all.size() : 0),
        behind(all.size()),
        behind_error(has_surfaces ? all.size() : 0),
        lit(has_shades ? all.size() * march.suns().size() : 0),
        hazes(march.kernel.hazes.empty() ? 0 : all.size()),
        stride(march.kernel.media() * sums_per_medium(march.kernel)),
        sums(all.size() * stride) {
    march.weights_for(all[0].d, weights);
    if (!kHasPhase || march.is_isotropic()) {
      brightest = march.brightest(weights.data());
      sunlit = march.sunlit(weights.data());
      return;
    }
    const size_t count = weights.size();
    weights.resize(all.size() * count);
    std::vector<float> own;
    for (size_t i = 1; i < all.size(); ++i) {
      march.weights_for(all[i].d, own);
      std::copy(own.begin(), own.end(), weights.begin() + std::ptrdiff_t(i * count));
    }
    weights_step = count;
  }

  /// Finds what all rays meet, together.
  ///   seen: [ray]
  ///   are_neighbours: from the camera; it is worth knowing how far all of them meet nothing
  void find_hits(const World& world, std::span<const RaySight> seen, bool are_neighbours);

  /// Makes room for the fog of a world.
  void add_fog(const FogSetup& setup, bool from_camera) {
    are_from_camera = from_camera;
    fog.emplace(setup);
    fogs.resize(rays.size());
    fog_errors.resize(rays.size());
    fog_ends.resize(rays.size());
  }

  std::span<const Ray> rays;
  std::vector<MarchRay> jobs;
  std::vector<MarchResult> marched;
  std::vector<std::optional<WorldHit>> hits;  ///< none where there are no surfaces
  std::vector<Rgb> behind;                    ///< radiance from the end of each ray
  std::vector<double> behind_error;           ///< what rays that go on from there err; none without surfaces
  std::vector<double> behind_bound;           ///< the same, proven; empty where nobody asks or none goes on
  std::vector<std::vector<Segment>> lit;      ///< [ray][sun]; none where no solid shades a medium
  std::vector<char> dappled;                  ///< rays that solids with holes may shade; empty: none
  std::optional<RayFog> fog;                  ///< of the present ray; none where the world has none
  bool are_from_camera = true;
  std::vector<MarchFog> fogs;          ///< of each ray
  std::vector<double> fog_ends;        ///< how much of the end of each ray shows through all of it
  std::vector<double> fog_errors;      ///< what their tables may change, of an opaque medium
  std::vector<HazeRays::OnRay> hazes;  ///< of each ray; none where all media are grids
  size_t stride;
  std::vector<double> sums;
  std::vector<float> weights;
  size_t weights_step = 0;  ///< 0 where all rays share theirs
  double brightest = 0.0;   ///< of the media, where all rays share their weights
  double sunlit = 0.0;      ///< the same of sunlight alone
  uint64_t samples = 0, lookups = 0, leaps = 0;
  uint64_t bound_samples = 0, bound_lookups = 0;  ///< what proofs took, those of rays that go on included
};

/// Rays that go on from the ends of one packet of the kernel, to be traced together. Which these are
/// depends on that packet alone, and so does what they find.
struct SecondaryRays {
  std::vector<Ray> rays;
  std::vector<RayPath> paths;
  std::vector<Rgb> weights;
  std::vector<size_t> parents;

  void add(const SecondaryRay& next, const Rgb& weight, size_t parent) {
    rays.push_back(next.ray);
    paths.push_back(next.path);
    weights.push_back(weight);
    parents.push_back(parent);
  }
};

/// Marches all rays of a packet.
void march_packet(const MarchScene& scene, MarchPacket& packet);

/// Marches again, finer, the rays whose estimated error is above what is allowed; those of one packet of the
/// kernel together.
void refine_packet(const MarchScene& scene, double allowed, MarchPacket& packet);

}  // namespace pileus
