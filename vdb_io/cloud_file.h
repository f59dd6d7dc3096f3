#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "lib/cloud/cloud_fields.h"
#include "lib/cloud/procedural_cloud.h"
#include "vdb_io/cloud_grid_options.h"
#include "vdb_io/write_options.h"

namespace pileus {

/// The grids that a cloud can have besides "density", as the big programs call them: temperature (float), Cd
/// and vel (vectors).
const std::vector<std::string>& cloud_field_names();

struct NamedCloud {
  std::string name;  ///< of its volume
  ProceduralCloud cloud;
  CloudFieldsRecipe fields;
  CloudGridOptions options;  ///< its progress is CloudFileWatch's
};

/// Clouds as grids of a file. Grids of one cloud keep the names that programs look for; of several, each is
/// named after its cloud: "left", or "left_temperature" where there are more grids than one.
struct CloudFile {
  std::filesystem::path path;
  std::vector<NamedCloud> clouds;
  std::vector<std::string> grids{"density"};  ///< that, and cloud_field_names()
  VdbWriteOptions write;
};

/// Sees how the clouds of a file are built, one after the other.
class CloudFileWatch {
 public:
  virtual ~CloudFileWatch() = default;
  virtual void begin(const NamedCloud& cloud) = 0;
  virtual bool go_on(double share) = 0;  ///< the share of the density's voxels that is done; false cancels
  virtual void end(const NamedCloud& cloud, const CloudBuildCounters& counters) = 0;
};

}  // namespace pileus
