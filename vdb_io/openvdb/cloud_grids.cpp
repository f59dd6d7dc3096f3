#include "vdb_io/openvdb/cloud_grids.h"

#include <memory>
#include <utility>

#include <openvdb/tools/Prune.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"

namespace pileus {

namespace {

openvdb::Vec3f vector_of(const Vec3d& v) {
  return {float(v.x), float(v.y), float(v.z)};
}

/// Eight voxels along each edge: a leaf of the density, or an eighth of an edge of what is active as a whole.
struct FieldBlock {
  openvdb::Coord origin;
  const openvdb::FloatTree::LeafNodeType* density;  ///< null: `rho` everywhere
  float rho = 0.0f;
};

/// All blocks with active voxels, in a fixed order.
std::vector<FieldBlock> blocks_of(const openvdb::FloatTree& density) {
  constexpr int kEdge = int(openvdb::FloatTree::LeafNodeType::DIM);
  std::vector<FieldBlock> blocks;
  for (auto leaf = density.cbeginLeaf(); leaf; ++leaf) blocks.push_back({leaf->origin(), leaf.getLeaf()});
  auto tile = density.cbeginValueOn();
  tile.setMaxDepth(openvdb::FloatTree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    const openvdb::CoordBBox box = tile.getBoundingBox();
    for (int x = box.min().x(); x <= box.max().x(); x += kEdge) {
      for (int y = box.min().y(); y <= box.max().y(); y += kEdge) {
        for (int z = box.min().z(); z <= box.max().z(); z += kEdge)
          blocks.push_back({{x, y, z}, nullptr, *tile});
      }
    }
  }
  return blocks;
}

/// A grid that is active where the density is, with value(p_world, rho) there and 0 elsewhere. Blocks of one
/// value become tiles before the next is looked at, so that no more memory is taken than the grid needs.
template <class Grid, class Value>
typename Grid::Ptr field_grid(const std::string& name, const openvdb::FloatGrid& density,
                              const Value& value) {
  using Leaf = typename Grid::TreeType::LeafNodeType;
  const auto zero = openvdb::zeroVal<typename Grid::ValueType>();
  const std::vector<FieldBlock> blocks = blocks_of(density.tree());
  std::vector<std::unique_ptr<Leaf>> leaves(blocks.size());
  std::vector<typename Grid::ValueType> values(blocks.size());  // where there is no leaf
  parallel_for(blocks.size(), [&](size_t i) {
    const FieldBlock& block = blocks[i];
    auto leaf = std::make_unique<Leaf>(block.origin, zero, !block.density);
    if (block.density) leaf->setValueMask(block.density->valueMask());
    for (auto voxel = leaf->beginValueOn(); voxel; ++voxel) {
      const openvdb::Vec3d p = density.indexToWorld(voxel.getCoord());
      const float rho = block.density ? block.density->getValue(voxel.pos()) : block.rho;
      voxel.setValue(value(Vec3d(p.x(), p.y(), p.z()), double(rho)));
    }
    bool is_active = false;
    const bool is_tile = leaf->isConstant(values[i], is_active) && is_active;
    if (!is_tile) leaves[i] = std::move(leaf);
  });
  auto grid = Grid::create(zero);
  for (size_t i = 0; i < blocks.size(); ++i) {
    if (leaves[i]) {
      grid->tree().addLeaf(leaves[i].release());
    } else {
      grid->tree().addTile(1, blocks[i].origin, values[i], true);
    }
  }
  openvdb::tools::prune(grid->tree());
  grid->setTransform(density.transform().copy());
  grid->setCreator(density.getCreator());
  grid->setName(name);
  return grid;
}

}  // namespace

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
