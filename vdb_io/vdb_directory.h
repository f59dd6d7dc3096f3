#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace pileus {

/// Metadata by name, as text; entries that are neither text nor plain numbers show their type in <>.
using VdbMetadata = std::map<std::string, std::string>;

/// One grid as the file's directory describes it. Nothing of its voxels has been read.
struct VdbGridEntry {
  std::string name;        ///< unique in the file: "density", or "density[1]" where names repeat
  std::string base_name;   ///< "density"
  std::string tree_type;   ///< OpenVDB's name, such as "Tree_float_5_4_3"
  std::string value_type;  ///< "float", "vec3s", "bool", …; "points" for point data
  std::string grid_class;  ///< "fog volume", "level set", "staggered" or "unknown"
  std::string map_type;    ///< OpenVDB's name of the transform, such as "UniformScaleMap"
  bool saved_as_half = false;
  std::string shares_tree_with;  ///< name of the grid that holds the voxels, or ""
  uint32_t compression = 0;      ///< flags: 1 zip, 2 active mask, 4 blosc
  VdbMetadata metadata;
  uint64_t topology_begin = 0, blocks_begin = 0, end = 0;  ///< byte offsets in the file

  bool has_affine_map() const;  ///< false for frustums, and for transforms OpenVDB does not know
  bool is_scalar() const;       ///< a number or truth value per voxel, which pileus can read as a density
};

/// What a volume file says about itself before its voxels; made for `.vdb`, filled in for other formats too.
struct VdbDirectory {
  std::string format;  ///< "OpenVDB file version 224 (library 10.0)", "NanoVDB 32.4", …
  uint64_t file_bytes = 0;
  uint32_t file_version = 0;  ///< 0 in other formats, as the library's below
  uint32_t library_major = 0, library_minor = 0;
  VdbMetadata metadata;
  std::vector<VdbGridEntry> grids;  ///< in the order of the file
};

/// Reads the directory of a file without OpenVDB, which trusts every count and length it meets. Whatever
/// passes here has lengths that lie inside the file, so OpenVDB's own reading of the same bytes is bounded.
/// errors: Error(file) with one line: empty, Git LFS pointer, not OpenVDB, unknown version, cut short, …
VdbDirectory read_vdb_directory(const std::filesystem::path& path);

/// "blosc + active mask", "none", …
std::string compression_text(uint32_t flags);

/// "density (float, fog volume)": how messages show a grid.
std::string describe(const VdbGridEntry& grid);

}  // namespace pileus
