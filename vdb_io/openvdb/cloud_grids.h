#pragma once

#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "vdb_io/cloud_file.h"
#include "vdb_io/written_grid.h"

namespace pileus {

/// One of cloud_field_names(), active where the density is. Uses parallel_for; the same bit for bit whatever
/// the number of threads.
openvdb::GridBase::Ptr build_cloud_field(const std::string& name, const CloudFields& fields,
                                         const openvdb::FloatGrid& density);

/// Builds the clouds of a file and writes it.
/// errors: those of build_cloud, with the volume's name; those of write_vdb_grids; Error(cancelled)
std::vector<WrittenGrid> write_cloud_file(const CloudFile& file, CloudFileWatch& watch);

}  // namespace pileus
