#pragma once

#include <filesystem>
#include <vector>

#include "vdb_io/finding.h"
#include "vdb_io/inspect.h"

namespace pileus {

/// What is wrong, suspicious or worth knowing about a file, judged from what an inspection saw: values no
/// density may have, empty and repeated grids, level sets given as densities, units that are probably not
/// meant, statistics that do not fit. What each number is judged by stands in docs/robustness.md.
///   path: as the commands of the fixes shall name the file
std::vector<Finding> find_trouble(const std::filesystem::path& path, const VdbReport& report);

}  // namespace pileus
