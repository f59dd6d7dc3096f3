#pragma once

#include <filesystem>

#include <openvdb/openvdb.h>

#include "vdb_io/nvdb/nvdb_file.h"

namespace pileus {

/// The OpenVDB grid behind a memory image: values of active and inactive voxels and tiles, states, transform,
/// class and name are NanoVDB's own. Fp4, Fp8, Fp16 and FpN grids become float.
/// Nothing in the image is trusted: every offset lies inside it and is aligned, no node is met more often
/// than the image claims to have nodes, masks do not contradict each other, the transform can be inverted,
/// and the checksum (of NanoVDB 32.0 to 32.5, where there is one) is right.
/// errors: Error(file) with the byte in the unpacked grid; for types other than float, double, int32, bool,
/// vec3s
///         and the Fp ones
openvdb::GridBase::Ptr grid_from_nvdb(const std::filesystem::path& path, const NvdbGridEntry& entry,
                                      const NvdbBuffer& buffer);

/// The memory image of a grid, with statistics of every node and a full checksum.
/// errors: Error(file) for other types than the above, and for transforms that are not affine
NvdbBuffer nvdb_from_grid(const std::filesystem::path& path, const openvdb::GridBase& grid);

}  // namespace pileus
