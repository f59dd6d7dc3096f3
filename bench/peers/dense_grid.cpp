#include "bench/peers/dense_grid.h"

#include <algorithm>
#include <cmath>

#include "lib/core/error.h"
#include "vdb_io/openvdb/grid_values.h"
#include "vdb_io/openvdb/openvdb_library.h"
#include "vdb_io/openvdb/vdb_reader.h"

namespace pileus::bench {
namespace {

/// Throws unless the grid's axes are the world's and its voxels cubes: the marcher knows no other.
double cube_edge(const std::filesystem::path& file, const Affine& world_from_index) {
  const Imath::M44d& m = world_from_index.matrix();
  const double edge = m[0][0];
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      if (std::abs(m[row][column] - (row == column ? edge : 0.0)) > 1e-12 * std::abs(edge)) {
        throw Error(ErrorKind::file, file.string(),
                    "has voxels that are no cubes along the axes of the world");
      }
    }
  }
  return edge;
}

}  // namespace

DenseGrid read_dense_grid(const std::filesystem::path& file) {
  initialize_openvdb();
  const openvdb::FloatGrid::Ptr sparse = read_density_grid(file).grid;
  const Affine from_index = world_from_index(file, *sparse);
  openvdb::CoordBBox box = sparse->evalActiveVoxelBoundingBox();
  box.min().offset(-1);
  box.max().offset(2);

  DenseGrid grid;
  grid.voxel_size = cube_edge(file, from_index);
  grid.origin = from_index.point(Vec3d(box.min().x(), box.min().y(), box.min().z()));
  grid.size = Vec3i(box.dim().x(), box.dim().y(), box.dim().z());
  grid.rho.resize(size_t(grid.size.x) * size_t(grid.size.y) * size_t(grid.size.z));
  const auto values = sparse->getConstAccessor();
  float* rho = grid.rho.data();
  for (int z = 0; z < grid.size.z; ++z) {
    for (int y = 0; y < grid.size.y; ++y) {
      for (int x = 0; x < grid.size.x; ++x) *rho++ = values.getValue(box.min().offsetBy(x, y, z));
    }
  }
  return grid;
}

void find_lit_blocks(DenseGrid& grid) {
  constexpr int kBlock = DenseGrid::kBlock;
  const auto blocks_of = [](int voxels) { return (voxels - 1 + kBlock - 1) / kBlock; };
  grid.blocks = Vec3i(blocks_of(grid.size.x), blocks_of(grid.size.y), blocks_of(grid.size.z));
  grid.lit.assign(size_t(grid.blocks.x) * size_t(grid.blocks.y) * size_t(grid.blocks.z), 0);
  for (int z = 0; z < grid.size.z; ++z) {
    for (int y = 0; y < grid.size.y; ++y) {
      for (int x = 0; x < grid.size.x; ++x) {
        if (!(grid.rho[grid.index(x, y, z)] > 0.0f)) continue;
        // The voxel is a corner of the cells from (x - 1, y - 1, z - 1) to (x, y, z).
        for (int bz = std::max(z - 1, 0) / kBlock; bz <= std::min(z / kBlock, grid.blocks.z - 1); ++bz) {
          for (int by = std::max(y - 1, 0) / kBlock; by <= std::min(y / kBlock, grid.blocks.y - 1); ++by) {
            for (int bx = std::max(x - 1, 0) / kBlock; bx <= std::min(x / kBlock, grid.blocks.x - 1); ++bx) {
              grid.lit[grid.block_index(bx, by, bz)] = 1;
            }
          }
        }
      }
    }
  }
}

}  // namespace pileus::bench
