#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "lib/cloud/cloud_recipe.h"
#include "lib/scene/medium.h"

namespace pileus {

/// The volume `cloud`, in a header of its own for those who want its grid: `pileus cloud`.
struct CloudVolume final : Medium {
  std::string bounds;  ///< name of the free form
  double voxel_size = 0.0;
  int max_voxels = 1 << 29;
  CloudRecipe recipe;

  void describe_density(ParamTable& params) override;
  void commit(std::vector<std::string>& problems) override;
  bool is_grid() const override { return true; }
  std::shared_ptr<const DensityField> build(const FreeForms& freeforms) const override;

  /// The cloud as a grid in world space. progress as in CloudGridOptions. Throws Error.
  openvdb::FloatGrid::Ptr build_grid(const FreeForms& freeforms, std::function<bool(double)> progress) const;
};

}  // namespace pileus
