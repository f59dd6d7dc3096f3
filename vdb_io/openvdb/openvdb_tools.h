#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "lib/cloud/procedural_cloud.h"
#include "vdb_io/cloud_file.h"
#include "vdb_io/conversion.h"
#include "vdb_io/density_voxels.h"
#include "vdb_io/inspect.h"
#include "vdb_io/read_options.h"
#include "vdb_io/written_grid.h"

// What libpileus and libpileus_openvdb say to each other. OpenVDB's library holds 60,000 addresses that every
// start of a program that is linked with it must look up, in a twentieth of a second: many a picture takes no
// longer. All that needs OpenVDB lies in a library of its own, loaded at first use (vdb_io/load_openvdb.h).
namespace pileus {

inline constexpr const char* kOpenVdbFile = "libpileus_openvdb.so";

/// What the library does. Errors are thrown as Error, as everywhere: it is linked with libpileus.
class OpenVdbTools {
 public:
  /// read_density_grid
  virtual DensityVoxels read_density(const std::filesystem::path& path,
                                     const VdbReadOptions& options) const = 0;
  /// build_cloud, as a field in world space
  virtual std::shared_ptr<const DensityField> build_cloud_field(const ProceduralCloud& cloud,
                                                                const CloudGridOptions& options) const = 0;
  virtual VdbReport inspect_vdb(const std::filesystem::path& path, const std::string& grid) const = 0;
  virtual std::vector<WrittenGrid> write_cloud_file(const CloudFile& file, CloudFileWatch& watch) const = 0;
  /// carry_volume; then, after calling before_writing, write_carried
  virtual std::vector<WrittenGrid> convert(const Conversion& conversion, const Tell& tell,
                                           const std::function<void()>& before_writing) const = 0;

 protected:
  ~OpenVdbTools() = default;
};

}  // namespace pileus

/// The version of pileus that the library was built with: classes cross this border, so it must be the same.
extern "C" const char* pileus_openvdb_version();
extern "C" const pileus::OpenVdbTools* pileus_openvdb();
