#pragma once

#include <span>
#include <vector>

#include "integrators/kernels/march_kernel.h"
#include "lib/scene/light.h"
#include "lib/scene/world.h"

namespace pileus {

/// The analytic media of a world on rays, in the form that the march kernels read: where a ray is in each,
/// and their optical depth towards the suns, in closed form at nodes as close as linear interpolation asks
/// for.
class HazeRays {
 public:
  /// What one ray keeps for its job.
  struct OnRay {
    std::vector<HazeStretch> stretches;          ///< [haze]
    std::vector<std::vector<HazeDepth>> depths;  ///< [sun]
    double depth_error = 0.0;  ///< what they may err by: the more, the less of the media the ray shows

    /// False where some haze is on the ray in a form that kernels do not read: in two stretches, with a
    /// density that is no exponential, or so dense that rounding would tell. The ray then seems to be in
    /// none.
    bool is_readable = true;
  };

  ///   grids: boxes of the media that may shade hazes
  ///   suns: none where nothing scatters
  ///   bounds: of all media, grids included: depths are wanted there
  ///   depth_error: what depths may err by on a ray that ends in the media
  HazeRays(std::span<const WorldMedium* const> hazes, std::span<const Box3d> grids,
           std::span<const Illumination> suns, const Box3d& bounds, double depth_error);

  bool any() const { return !m_hazes.empty(); }

  /// Gives a ray, whose segment is set, what kernels have to know.
  void place(MarchRay& job, OnRay& own) const;

 private:
  bool find_stretch(const WorldMedium& haze, const MarchRay& job, HazeStretch& stretch, double& tau) const;
  double opacity(const MarchRay& job, double tau) const;
  void fill_depths(size_t sun, const MarchRay& job, OnRay& own) const;
  double depth(size_t sun, const Vec3d& p) const;
  Segment grid_shadows(const Ray& ray, Segment segment) const;

  std::vector<const WorldMedium*> m_hazes;
  std::vector<Box3d> m_grids;
  std::vector<Illumination> m_suns;
  Box3d m_bounds;
  double m_depth_error;
};

}  // namespace pileus
