#pragma once

#include "vdb_io/openvdb/openvdb_tools.h"

namespace pileus {

/// All that needs OpenVDB: libpileus_openvdb, loaded on the first call from beside libpileus.
/// errors: Error(failed) where it cannot be loaded
const OpenVdbTools& load_openvdb();

}  // namespace pileus
