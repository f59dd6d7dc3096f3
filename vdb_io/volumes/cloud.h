#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lib/cloud/cloud_fields.h"
#include "lib/cloud/procedural_cloud.h"
#include "lib/scene/medium.h"
#include "lib/scene/texture.h"
#include "vdb_io/cloud_grid_options.h"

namespace pileus {

/// The volume `cloud`, in a header of its own for those who want its grid: `pileus cloud`.
struct CloudVolume final : Medium {
  std::string bounds;          ///< name of the free form; "": that of the preset
  std::filesystem::path mesh;  ///< a closed one, instead
  Placement mesh_placement;
  Vec3d center{0.0, 0.0, 0.0}, size{0.0, 0.0, 0.0};  ///< of the preset's free form [m]
  double voxel_size = 0.0;
  double max_voxels = 0.0;  ///< 0: kMaxVoxels
  double max_bytes = 0.0;
  CloudRecipe recipe;
  CloudFieldsRecipe fields;
  std::shared_ptr<const Texture> density_texture;  ///< by which the density is multiplied; null: none

  static constexpr int64_t kMaxVoxels = int64_t(1) << 29;

  void describe_density(ParamTable& params) override;
  void commit(std::vector<std::string>& problems) override;
  bool is_grid() const override { return true; }
  std::shared_ptr<const DensityField> build(const FreeForms& freeforms) const override;

  /// The cloud as a function of space. Throws Error.
  ProceduralCloud cloud(const FreeForms& freeforms) const;

  /// How it is made into a grid in world space.
  CloudGridOptions grid_options() const;

 private:
  ProceduralCloud::DensityMap density_map() const;
};

}  // namespace pileus
