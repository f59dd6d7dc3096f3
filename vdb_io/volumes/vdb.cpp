/// A density grid of a volume file (.vdb, .nvdb, .df3, .npy, .raw), shown by trilinear interpolation between
/// voxel centres.
///
///   [volume.plume]
///   type = "vdb"
///   file = "smoke1.vdb"
///   grid = "density"          # may be left out where the file leaves no doubt
///   extinction = 4.0          # [1/m] where the grid holds 1
///   translate = [0, 2, 0]
///
/// The grid's own transform places it, in metres; scale, rotate_deg and translate come on top. Level sets are
/// turned into fog only on request, and NaN, infinite or negative densities are an error unless `nan =
/// "zero"`.
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "lib/scene/medium.h"
#include "vdb_io/density_voxels.h"
#include "vdb_io/volumes/reading_notes.h"

namespace pileus {
namespace {

class LoadedVoxels final : public LoadedDensity, public ReadingNotes {
 public:
  LoadedVoxels(DensityVoxels density, const Affine& world_from_object)
      : m_voxels(std::move(density.voxels)),
        m_notes(std::move(density.notes)),
        m_world_from_object(world_from_object) {}

  std::vector<std::string> notes() const override { return m_notes; }

  std::shared_ptr<const DensityField> build() const override {
    return field_from_voxels(m_voxels, m_world_from_object);
  }

 private:
  GridVoxels m_voxels;
  std::vector<std::string> m_notes;
  Affine m_world_from_object;
};

struct VdbVolume final : Medium {
  std::filesystem::path file;
  std::string grid, level_set = "refuse", nan = "refuse";
  Placement placement;

  void describe_density(ParamTable& params) override {
    params.file("file", file, "the file: .vdb, .nvdb, .df3, .npy or .raw").required();
    params.text(
        "grid", grid,
        "name of the grid; by default density or what other programs call it, or the only fog volume");
    params.text("level_set", level_set, "what a level set becomes").one_of({"refuse", "fog"});
    params.text("nan", nan, "what NaN, infinite and negative densities become").one_of({"refuse", "zero"});
    placement.describe(params);
  }

  bool is_grid() const override { return true; }
  Affine world_from_object() const override { return placement.world_from_object(); }

  std::unique_ptr<LoadedDensity> load() const override {
    const VdbReadOptions options{grid, level_set == "fog" ? LevelSetPolicy::to_fog : LevelSetPolicy::refuse,
                                 nan == "zero" ? BadValuePolicy::to_zero : BadValuePolicy::refuse};
    return std::make_unique<LoadedVoxels>(read_density(file, options), world_from_object());
  }

  std::shared_ptr<const DensityField> build(const FreeForms&) const override { return load()->build(); }
};

}  // namespace

PILEUS_PLUGIN(Medium, vdb, VdbVolume, "density grid of a volume file")

}  // namespace pileus
