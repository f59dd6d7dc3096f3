#include "vdb_io/cloud_grids.h"

#include <openvdb/tools/Prune.h>
#include <openvdb/tree/LeafManager.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"

namespace pileus {

namespace {

openvdb::Vec3f vector_of(const Vec3d& v) {
  return {float(v.x), float(v.y), float(v.z)};
}

/// A grid that is active where the density is, with value(p_world, rho) there and 0 elsewhere.
template <class Grid, class Value>
typename Grid::Ptr field_grid(const std::string& name, const openvdb::FloatGrid& density,
                              const Value& value) {
  using Tree = typename Grid::TreeType;
  const auto zero = openvdb::zeroVal<typename Grid::ValueType>();
  auto grid = Grid::create(std::make_shared<Tree>(density.tree(), zero, openvdb::TopologyCopy()));
  grid->tree().voxelizeActiveTiles();
  openvdb::tree::LeafManager<Tree> leaves(grid->tree());
  parallel_for(leaves.leafCount(), [&](size_t i) {
    auto& leaf = leaves.leaf(i);
    const auto rho = density.getConstAccessor();
    for (auto voxel = leaf.beginValueOn(); voxel; ++voxel) {
      const openvdb::Vec3d p = density.indexToWorld(voxel.getCoord());
      voxel.setValue(value(Vec3d(p.x(), p.y(), p.z()), double(rho.getValue(voxel.getCoord()))));
    }
  });
  openvdb::tools::prune(grid->tree());
  grid->setTransform(density.transform().copy());
  grid->setCreator(density.getCreator());
  grid->setName(name);
  return grid;
}

}  // namespace

const std::vector<std::string>& cloud_field_names() {
  static const std::vector<std::string> names{"temperature", "Cd", "vel"};
  return names;
}

openvdb::GridBase::Ptr build_cloud_field(const std::string& name, const CloudFields& fields,
                                         const openvdb::FloatGrid& density) {
  if (name == "temperature") {
    const auto grid = field_grid<openvdb::FloatGrid>(
        name, density, [&](const Vec3d& p, double rho) { return float(fields.temperature(p, rho)); });
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    return grid;
  }
  if (name == "Cd") {
    const auto grid = field_grid<openvdb::Vec3SGrid>(
        name, density, [&](const Vec3d& p, double) { return vector_of(fields.color(p)); });
    grid->setVectorType(openvdb::VEC_INVARIANT);
    return grid;
  }
  PILEUS_CHECK(name == "vel");
  const auto grid = field_grid<openvdb::Vec3SGrid>(
      name, density, [&](const Vec3d& p, double rho) { return vector_of(fields.velocity(p, rho)); });
  grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  return grid;
}

}  // namespace pileus
