#pragma once

#include <filesystem>

#include <openvdb/openvdb.h>

#include "lib/math/affine.h"
#include "vdb_io/value_counts.h"
#include "vdb_io/vdb_transform.h"

namespace pileus {

ValueCounts count_values(const openvdb::FloatGrid& grid);

/// The transform of a grid that has an affine one, in double. Throws Error(file) where it is singular or not
/// finite.
Affine world_from_index(const std::filesystem::path& path, const openvdb::GridBase& grid);

}  // namespace pileus
