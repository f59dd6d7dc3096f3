#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lib/volume/density_field.h"
#include "vdb_io/grid_voxels.h"
#include "vdb_io/read_options.h"
#include "vdb_io/vdb_directory.h"

namespace pileus {

/// A density as it is to be rendered.
struct DensityVoxels {
  /// Values finite and >= 0, background 0. The counts are as found in the file (before bad values became 0,
  /// after a level set became fog).
  GridVoxels voxels;
  VdbGridEntry source;             ///< what the file says about it
  std::vector<std::string> notes;  ///< what was chosen or converted on the way, a sentence each
};

/// Reads one density grid of a volume file of any format; where it is no .vdb file, by way of OpenVDB.
/// errors: those of read_density_grid
DensityVoxels read_density(const std::filesystem::path& path, const VdbReadOptions& options = {});

/// Reads one density grid of a .vdb file without OpenVDB: what read_density_grid (vdb_io/openvdb) reads, with
/// the same choices, notes and errors.
DensityVoxels read_density_voxels(const std::filesystem::path& path, const VdbReadOptions& options = {});

/// The field of a density, which keeps its values.
///   world_from_object: placed on top of the grid's own transform
/// errors: Error(scene) where the placement cannot be inverted; those of VoxelSource
std::shared_ptr<const DensityField> field_from_voxels(const GridVoxels& voxels,
                                                      const Affine& world_from_object);

/// The same for voxels that are ready.
std::shared_ptr<const DensityField> place_field(VoxelSource voxels, const Affine& world_from_index,
                                                const Affine& world_from_object);

}  // namespace pileus
