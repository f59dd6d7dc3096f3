#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "lib/math/affine.h"
#include "vdb_io/vdb_directory.h"

namespace pileus {

/// Bytes of the parameters of a transform in the file, which no length precedes. 0: not a transform pileus
/// reads.
uint64_t map_bytes(const std::string& map_type);

/// The transform of a grid that has an affine one, in double, from the bytes that the file has for it.
/// errors: Error(file) where it is singular, not finite or not affine after all
Affine read_world_from_index(const std::filesystem::path& path, const VdbGridEntry& grid);

/// A grid's matrix, held against what a renderer can invert; it is that of row vectors, as OpenVDB has it.
/// errors: as above
Affine checked_world_from_index(const std::filesystem::path& path, const std::string& grid,
                                const Imath::M44d& matrix);

/// Turns a transform away. `found` is "singular", as a rule.
[[noreturn]] void refuse_transform(const std::filesystem::path& path, const std::string& grid,
                                   const char* found);

/// Lengths of a voxel's three edges [m].
Vec3d voxel_edges(const Affine& world_from_index);

}  // namespace pileus
