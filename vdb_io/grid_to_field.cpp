#include "vdb_io/grid_to_field.h"

#include <cmath>
#include <utility>
#include <vector>

#include <nanovdb/util/OpenToNanoVDB.h>
#include <unistd.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/volume/grid_field.h"
#include "vdb_io/grid_values.h"
#include "vdb_io/openvdb_library.h"

namespace pileus {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using LeafNode = FloatTree::LeafNodeType;

constexpr int kLeafSize = 8;

/// Makes the leaf's non-zero voxels active, so that NanoVDB's bounding box holds them.
///   returns: bit dx + 2 dy + 4 dz: the leaf has a non-zero voxel whose cells reach into the neighbour at
///            -(dx, dy, dz) * 8; bit 0 (the leaf itself) is not used
unsigned activate_nonzero(LeafNode& leaf) {
  unsigned reached = 0;
  for (openvdb::Index n = 0; n < LeafNode::SIZE; ++n) {
    if (leaf.getValue(n) == 0.0f) continue;
    leaf.setActiveState(n, true);
    const Coord p = LeafNode::offsetToLocalCoord(n);
    const unsigned low = (p.x() == 0 ? 1u : 0u) | (p.y() == 0 ? 2u : 0u) | (p.z() == 0 ? 4u : 0u);
    for (unsigned subset = low; subset != 0; subset = (subset - 1) & low) reached |= 1u << subset;
  }
  return reached;
}

/// Makes cells findable by the node of their lower corner (make_grid_field's condition). Only nodes are
/// added: no value changes.
class CellCover {
 public:
  explicit CellCover(FloatTree& tree) : m_tree(tree), m_accessor(tree) {}

  void cover_cells_of_leaves() {
    std::vector<LeafNode*> leaves;
    m_tree.getNodes(leaves);
    std::vector<uint8_t> reached(leaves.size());
    constexpr size_t kLeavesPerTask = 256;
    parallel_for((leaves.size() + kLeavesPerTask - 1) / kLeavesPerTask, [&](size_t task) {
      const size_t end = std::min(leaves.size(), (task + 1) * kLeavesPerTask);
      for (size_t i = task * kLeavesPerTask; i < end; ++i) reached[i] = uint8_t(activate_nonzero(*leaves[i]));
    });
    for (size_t i = 0; i < leaves.size(); ++i) {
      for (int n = 1; n < 8; ++n) {
        if ((reached[i] >> n & 1u) == 0) continue;
        cover(leaves[i]->origin().offsetBy(-kLeafSize * (n & 1), -kLeafSize * (n >> 1 & 1),
                                           -kLeafSize * (n >> 2)));
      }
    }
  }

  /// Non-zero tiles become active, whatever they were, for interpolation reads them; zero tiles become
  /// inactive, so that rays leap over them. The lower faces of non-zero tiles get leaves.
  void cover_cells_of_tiles() {
    std::vector<openvdb::CoordBBox> tiles;
    auto tile = m_tree.beginValueAll();
    tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
    for (; tile; ++tile) {
      const bool is_nonzero = *tile != 0.0f;
      tile.setActiveState(is_nonzero);
      if (is_nonzero) tiles.push_back(tile.getBoundingBox());
    }
    check_memory_for_faces(tiles);
    for (const openvdb::CoordBBox& box : tiles) cover_lower_faces(box);
  }

 private:
  static void check_memory_for_faces(const std::vector<openvdb::CoordBBox>& tiles) {
    double leaves = 0.0;
    for (const openvdb::CoordBBox& box : tiles)
      leaves += 3.0 * std::pow(double(box.dim().x()) / kLeafSize + 1.0, 2);
    const double needed = 2.0 * leaves * sizeof(float) * LeafNode::SIZE;  // in OpenVDB, then in NanoVDB
    const double memory = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
    if (needed > 0.5 * memory) {
      throw Error(
          ErrorKind::file, SourceLoc{},
          fmt::format("a grid with {} constant tiles needs {:.0f} GB for their surfaces, of {:.0f} GB here; "
                      "clip the grid to its visible part",
                      tiles.size(), needed * 1e-9, memory * 1e-9));
    }
  }

  void cover_lower_faces(const openvdb::CoordBBox& box) {
    const Coord low = box.min().offsetBy(-kLeafSize);
    for (int x = low.x(); x <= box.max().x(); x += kLeafSize) {
      for (int y = low.y(); y <= box.max().y(); y += kLeafSize) {
        const bool is_on_low_face = x == low.x() || y == low.y();
        const int end = is_on_low_face ? box.max().z() : low.z();
        for (int z = low.z(); z <= end; z += kLeafSize) cover({x, y, z});
      }
    }
  }

  void cover(const Coord& origin) {
    if (m_accessor.isValueOn(origin) || m_accessor.probeConstLeaf(origin) != nullptr) return;
    m_accessor.touchLeaf(origin);
  }

  FloatTree& m_tree;
  openvdb::tree::ValueAccessor<FloatTree> m_accessor;
};

/// The grid's copy lives only here: it is gone when the field builds what it needs beside the NanoVDB grid.
nanovdb::GridHandle<nanovdb::HostBuffer> covered_nano_grid(const openvdb::FloatGrid& grid) {
  const openvdb::FloatGrid::Ptr covered = grid.deepCopy();
  CellCover cover(covered->tree());
  cover.cover_cells_of_tiles();
  cover.cover_cells_of_leaves();
  if (covered->activeVoxelCount() == 0)
    covered->tree().setValueOn(Coord(0), 0.0f);  // a box that is not inverted
  return nanovdb::openToNanoVDB(*covered, nanovdb::StatsMode::BBox, nanovdb::ChecksumMode::Disable);
}

}  // namespace

std::shared_ptr<const DensityField> field_from_grid(const openvdb::FloatGrid& grid,
                                                    const Affine& world_from_object) {
  initialize_openvdb();
  PILEUS_CHECK(grid.background() == 0.0f);
  const Affine world_from_grid = world_from_object * world_from_index({}, grid);
  const double volume = world_from_grid.determinant();
  if (!(std::abs(volume) > 1e-200 && std::abs(volume) < 1e200)) {
    throw Error(
        ErrorKind::scene, SourceLoc{},
        fmt::format("its placement makes voxels of {} m3; expected a scale that a computer can invert",
                    volume));
  }
  return make_grid_field(covered_nano_grid(grid), world_from_grid);
}

}  // namespace pileus
