#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lib/scene/scattering.h"
#include "lib/scene/scene.h"
#include "lib/scene/shape_index.h"

namespace pileus {

/// A volume ready to render: its density and what light does in it.
struct WorldMedium {
  std::string name;
  std::shared_ptr<const DensityField> density;
  double extinction;  ///< sigma_t = extinction * rho [1/m]
  Rgb albedo;         ///< sigma_s / sigma_t
  Rgb emission;       ///< radiance per metre = emission * rho [W/(m3 sr)]
  std::shared_ptr<const PhaseFunction> phase;
  std::vector<ScatterTerm> scattering{ScatterTerm{}};  ///< response to lights; never empty
  AmbientLight ambient{};                              ///< light of the sky around
};

/// Fog ready to render.
struct WorldFog {
  std::string name;
  std::shared_ptr<const FogModel> model;
  FogView view;
};

/// The scene as integrators see it: everything loaded and built, nothing that changes any more.
struct World {
  std::vector<WorldMedium> media;
  std::vector<std::shared_ptr<const Light>> lights;
  std::vector<std::shared_ptr<const Shape>> shapes;
  std::shared_ptr<const ShapeIndex> index;  ///< of the shapes; null: rays ask each of them
  std::vector<WorldFog> fogs;               ///< between the camera and what its rays show
  std::shared_ptr<const Background> background;
  std::shared_ptr<const Camera> camera;
};

/// What the volumes of a scene have read from files, one entry per volume; null where nothing is read.
using LoadedVolumes = std::vector<std::unique_ptr<LoadedDensity>>;

/// Reads the files of the visible volumes. Throws Error, with the volume's name, where that fails.
LoadedVolumes load_volumes(const Scene& scene);

/// Builds what the scene describes. What was loaded is gone afterwards: fields keep what they need. Throws
/// Error, with the volume's name, where that fails.
World build_world(const Scene& scene, LoadedVolumes loaded);
inline World build_world(const Scene& scene) {
  return build_world(scene, load_volumes(scene));
}

/// Nearest solid surface with t in (segment.t0, segment.t1).
///   seen, clear: ShapeIndex::nearest
std::optional<WorldHit> nearest_surface(const World& world, const Ray& ray, Segment segment,
                                        const RaySight& seen = {}, std::span<const double> clear = {});

/// The same of neighbouring rays from t = 0 on, together.
void nearest_surfaces(const World& world, std::span<const Ray> rays, std::span<const RaySight> seen,
                      std::span<const double> clear, std::span<std::optional<WorldHit>> hits);

/// What is clear before neighbouring rays, per shape; empty where nothing is known.
void clear_distances(const World& world, std::span<const Ray> rays, const RaySight& seen,
                     std::vector<double>& clear);

/// True where a solid without holes stands in the segment: the shadow query of solids.
bool is_occluded(const World& world, const Ray& ray, Segment segment, const RaySight& seen = {});

/// The same of neighbouring rays, together.
void find_occluded(const World& world, std::span<const Ray> rays, std::span<const Segment> segments,
                   std::span<const RaySight> seen, std::span<char> occluded);

/// The shadow query of solids with holes: the share of light that passes all of them in the segment.
///   crossings: grows by the number of surfaces whose textures were asked
double light_through_holes(const World& world, const Ray& ray, Segment segment, const RaySight& seen,
                           uint64_t& crossings);

}  // namespace pileus
