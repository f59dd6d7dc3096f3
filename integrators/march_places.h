#pragma once

#include <span>
#include <vector>

#include "integrators/kernels/march_kernel.h"
#include "lib/math/ray.h"

namespace pileus {

/// Fills what the kernels know of places, where some grid stands in several; kinds in any case.
///   places: [grid]: its local space from the world, for each place
void add_places(const std::vector<std::vector<Affine>>& places, MarchScene& scene);

/// A grid where it stands, and the part of a ray that is in its bounds there.
struct GridOnRay {
  const MarchGrid& grid;
  Ray local;
  Segment inside;
};

/// The grids on a ray from t = 0 on, in the order of their places.
std::vector<GridOnRay> grids_on_ray(const MarchScene& scene, const Ray& ray);

/// What the lattices say of the optical depth of all grids from a point towards a light.
double lattice_depth(const MarchScene& scene, size_t light, const Vec3d& p);

}  // namespace pileus
