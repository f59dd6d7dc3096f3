#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <openvdb/openvdb.h>

#include "lib/math/vec.h"
#include "vdb_io/openvdb/resample.h"
#include "vdb_io/openvdb/volume_writer.h"

namespace pileus {

/// Values for grids by name.
using GridNumbers = std::vector<std::pair<std::string, double>>;

/// What happens to grids on their way from files to a file, in this order.
struct GridChanges {
  bool level_set_to_fog = false;
  GridNumbers nan, lowest, factors, backgrounds;  ///< of replace_nan, raise_to, … (grid_edits.h)
  std::optional<Box3d> crop;                      ///< [m]
  double scale = 1.0;
  std::optional<NewVoxels> voxels;
  std::vector<std::pair<std::string, std::string>> renamings;  ///< old name, new name
};

/// Grids of one file, or of several, for a new file.
struct Conversion {
  std::filesystem::path input, output;
  std::vector<std::filesystem::path> merged;  ///< more inputs
  std::vector<std::string> grids;             ///< those to take, by name or alias; none: all
  GridChanges changes;
  VolumeWriteOptions write;
};

/// A grid on its way, and what its file calls it: uniquely, and as it stands there.
struct CarriedGrid {
  openvdb::GridBase::Ptr grid;
  std::string name_in_file, base_name;
};

struct CarriedVolume {
  std::vector<CarriedGrid> grids;
  openvdb::MetaMap metadata;  ///< of the file as a whole
};

/// Hears of what was chosen, changed or left out, a sentence each.
using Tell = std::function<void(const std::string&)>;

/// Reads and changes the grids; writes nothing.
/// errors: Error(file) as the readers and edits; Error(usage) for grids that are not there, two of one name,
///         an output that is an input or no volume
CarriedVolume carry_volume(const Conversion& conversion, const Tell& tell);

/// Writes what carry_volume made of it.
/// errors: as write_volume
void write_carried(const Conversion& conversion, const CarriedVolume& volume, const Tell& tell);

}  // namespace pileus
