#pragma once

#include <memory>
#include <vector>

#include "lib/math/affine.h"
#include "lib/volume/density_field.h"

namespace pileus {

/// A grid in many places: its density is the sum over them. The voxels are held once; a ray finds the places
/// that it meets in about log n steps.
///   grid: has bricks
///   placed_from_grid: for each place the map from where the grid stands to there; none singular, one at
///   least
std::shared_ptr<const DensityField> make_instanced_field(std::shared_ptr<const DensityField> grid,
                                                         const std::vector<Affine>& placed_from_grid);

/// Adds pieces to others of the same ray: both lists are ordered and disjoint, and so is the result. Where
/// they overlap they are cut, and the densities added; all are cubics there.
void add_pieces(std::vector<DensityPiece>& sum, const std::vector<DensityPiece>& others);

}  // namespace pileus
