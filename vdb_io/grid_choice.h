#pragma once

#include <filesystem>
#include <string>

#include "vdb_io/vdb_directory.h"

namespace pileus {

/// The grid that `wanted` names. Where it is "", the one that a file without instructions means: "density",
/// else the only fog volume whose name means that (grid_aliases.h), else its only scalar fog volume (a scalar
/// grid of unknown class counts as one). An alias does for a wanted name, too, where nothing has it.
/// errors: Error(file) that lists what there is
const VdbGridEntry& choose_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                const std::string& wanted);

/// Turns away what is not a scalar grid, with what it is good for. Throws Error(file).
void require_scalar(const std::filesystem::path& path, const VdbGridEntry& grid);

}  // namespace pileus
