#pragma once

#include <openvdb/openvdb.h>

namespace pileus {

/// The grids that pileus reads and writes as they are.
using KnownGrids =
    openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Int32Grid, openvdb::Int64Grid,
                      openvdb::BoolGrid, openvdb::Vec3SGrid, openvdb::Vec3DGrid, openvdb::Vec3IGrid>;

/// Calls visit(grid) with the grid's own type; false where it is none of KnownGrids.
template <class Visit>
bool visit_grid(const openvdb::GridBase& grid, const Visit& visit) {
  return grid.apply<KnownGrids>(visit);
}
template <class Visit>
bool visit_grid(openvdb::GridBase& grid, const Visit& visit) {
  return grid.apply<KnownGrids>(visit);
}

}  // namespace pileus
