#include "vdb_io/openvdb/openvdb_tools.h"

#include <utility>

#include "lib/core/version.h"
#include "vdb_io/openvdb/build_cloud.h"
#include "vdb_io/openvdb/carried_volume.h"
#include "vdb_io/openvdb/cloud_grids.h"
#include "vdb_io/openvdb/grid_to_field.h"
#include "vdb_io/openvdb/grid_to_voxels.h"
#include "vdb_io/openvdb/vdb_reader.h"
#include "vdb_io/openvdb/vdb_writer.h"

namespace pileus {
namespace {

class Tools final : public OpenVdbTools {
 public:
  DensityVoxels read_density(const std::filesystem::path& path,
                             const VdbReadOptions& options) const override {
    DensityGrid density = read_density_grid(path, options);
    DensityVoxels result{voxels_of(*density.grid), std::move(density.source), std::move(density.notes)};
    result.voxels.counts = density.values;
    result.voxels.owner = density.grid;
    return result;
  }

  std::shared_ptr<const DensityField> build_cloud_field(const ProceduralCloud& cloud,
                                                        const CloudGridOptions& options) const override {
    return field_from_grid(build_cloud(cloud, options), Affine());
  }

  VdbReport inspect_vdb(const std::filesystem::path& path, const std::string& grid) const override {
    return pileus::inspect_vdb(path, grid);
  }

  std::vector<WrittenGrid> write_cloud_file(const CloudFile& file, CloudFileWatch& watch) const override {
    return pileus::write_cloud_file(file, watch);
  }

  std::vector<WrittenGrid> convert(const Conversion& conversion, const Tell& tell,
                                   const std::function<void()>& before_writing) const override {
    const CarriedVolume volume = carry_volume(conversion, tell);
    before_writing();
    return write_carried(conversion, volume, tell);
  }
};

}  // namespace
}  // namespace pileus

const char* pileus_openvdb_version() {
  return pileus::kVersion;
}

const pileus::OpenVdbTools* pileus_openvdb() {
  static const pileus::Tools tools;
  return &tools;
}
