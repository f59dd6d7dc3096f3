#pragma once

#include <memory>
#include <vector>

#include "lib/cloud/procedural_cloud.h"
#include "lib/math/ray.h"
#include "lib/volume/density_field.h"

namespace pileus::bench {

/// A cumulus about 1.3 m wide: what the benchmarks of this folder look at.
const ProceduralCloud& cumulus();

/// Edge of a voxel [m] that gives a grid of about `voxels` voxels along the cloud's longest axis.
double cumulus_voxel_size(int voxels);

/// The cumulus on a grid of that size; built once per size.
std::shared_ptr<const DensityField> cumulus_field(int voxels);

/// Rays of a camera that sees the whole box, in the order of `pixels` x `pixels` of a picture: neighbours
/// follow each other, as they do in a renderer.
std::vector<Ray> camera_rays(const Box3d& box, int pixels);

}  // namespace pileus::bench
