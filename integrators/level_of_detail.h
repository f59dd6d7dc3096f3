#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "integrators/march_scene.h"

namespace pileus {

/// For each grid, the coarsest level that comes into question for a picture: the one whose voxels, where the
/// grid is nearest to the camera, are just not larger than a pixel. 0: only the grid as it is.
std::vector<int> coarsest_levels(const World& world, const Vec2i& picture);

/// At which levels the march reads the grids.
struct LevelChoice {
  bool is_coarser = false;           ///< some grid is not read as it is
  double error = 0.0;                ///< estimated effect on a pixel that shows a medium [radiance]
  std::vector<std::string> reasons;  ///< for people
};

/// Marches pilot rays at the present levels, with steps so fine that they matter no more.
using PilotMarch = std::function<std::vector<RayResult>(std::span<const Ray>)>;

/// Sets the levels of march's grids so that the effect on a pixel is estimated to stay below `tolerance`.
/// Lattices of sunlight are to be built before: they keep the depths of the grids as they are.
///
/// The error is measured, not guessed: radiances of pilot rays all over the picture are compared with those
/// that the finest voxels give. Nor may a level take many more samples. Each level is built from the one
/// before and tried; the first that fails ends the search.
LevelChoice choose_levels(const World& world, const Vec2i& picture, double tolerance,
                          const std::vector<int>& coarsest, const PilotMarch& march_pilots,
                          MarchWorld& march);

}  // namespace pileus
