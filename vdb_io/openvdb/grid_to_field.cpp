#include "vdb_io/openvdb/grid_to_field.h"

#include "vdb_io/density_voxels.h"
#include "vdb_io/openvdb/grid_to_voxels.h"
#include "vdb_io/openvdb/openvdb_library.h"

namespace pileus {

std::shared_ptr<const DensityField> field_from_grid(openvdb::FloatGrid::ConstPtr grid,
                                                    const Affine& world_from_object) {
  initialize_openvdb();
  const auto same = openvdb::ConstPtrCast<openvdb::FloatGrid>(grid);  // its values are only read
  GridVoxels voxels = voxels_of(*same);
  voxels.owner = same;
  return field_from_voxels(voxels, world_from_object);
}

}  // namespace pileus
