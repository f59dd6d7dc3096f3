#pragma once

#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "vdb_io/conversion.h"
#include "vdb_io/written_grid.h"

namespace pileus {

/// A grid on its way, and what its file calls it: uniquely, and as it stands there.
struct CarriedGrid {
  openvdb::GridBase::Ptr grid;
  std::string name_in_file, base_name;
};

struct CarriedVolume {
  std::vector<CarriedGrid> grids;
  openvdb::MetaMap metadata;  ///< of the file as a whole
};

/// Reads and changes the grids; writes nothing.
/// errors: Error(file) as the readers and edits; Error(usage) for grids that are not there, two of one name,
///         an output that is an input or no volume
CarriedVolume carry_volume(const Conversion& conversion, const Tell& tell);

/// Writes what carry_volume made of it.
/// errors: as write_volume
std::vector<WrittenGrid> write_carried(const Conversion& conversion, const CarriedVolume& volume,
                                       const Tell& tell);

}  // namespace pileus
