#pragma once

#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "lib/cloud/cloud_fields.h"

namespace pileus {

/// The grids that a cloud can have besides "density", as the big programs call them: temperature (float), Cd
/// and vel (vectors).
const std::vector<std::string>& cloud_field_names();

/// One of them, active where the density is. Uses parallel_for; the same bit for bit whatever the number of
/// threads. `name` is one of cloud_field_names().
openvdb::GridBase::Ptr build_cloud_field(const std::string& name, const CloudFields& fields,
                                         const openvdb::FloatGrid& density);

}  // namespace pileus
