#pragma once

namespace pileus {

/// Registers OpenVDB's types once per process. Every function of vdb_io calls it first.
void initialize_openvdb();

}  // namespace pileus
