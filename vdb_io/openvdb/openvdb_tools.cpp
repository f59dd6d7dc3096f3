#include "vdb_io/openvdb/openvdb_tools.h"

#include <utility>

#include "lib/core/version.h"
#include "vdb_io/openvdb/build_cloud.h"
#include "vdb_io/openvdb/carried_volume.h"
#include "vdb_io/openvdb/cloud_grids.h"
#include "vdb_io/openvdb/grid_to_field.h"
#include "vdb_io/openvdb/vdb_reader.h"
#include "vdb_io/openvdb/vdb_writer.h"
#include "vdb_io/volumes/reading_notes.h"

namespace pileus {
namespace {

class LoadedGrid final : public LoadedDensity, public ReadingNotes {
 public:
  LoadedGrid(DensityGrid density, const Affine& world_from_object)
      : m_grid(std::move(density.grid)),
        m_notes(std::move(density.notes)),
        m_world_from_object(world_from_object) {}

  std::vector<std::string> notes() const override { return m_notes; }

  std::shared_ptr<const DensityField> build() const override {
    return field_from_grid(m_grid, m_world_from_object);
  }

 private:
  openvdb::FloatGrid::ConstPtr m_grid;
  std::vector<std::string> m_notes;
  Affine m_world_from_object;
};

class Tools final : public OpenVdbTools {
 public:
  std::unique_ptr<LoadedDensity> load_density(const std::filesystem::path& path,
                                              const VdbReadOptions& options,
                                              const Affine& world_from_object) const override {
    return std::make_unique<LoadedGrid>(read_density_grid(path, options), world_from_object);
  }

  std::shared_ptr<const DensityField> build_cloud_field(const ProceduralCloud& cloud,
                                                        const CloudGridOptions& options) const override {
    return field_from_grid(build_cloud(cloud, options), Affine());
  }

  GridSummary summarize_density(const std::filesystem::path& path, const std::string& grid) const override {
    return pileus::summarize_density(path, grid);
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
