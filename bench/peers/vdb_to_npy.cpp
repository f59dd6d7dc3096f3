/// vdb_to_npy CLOUD.vdb RHO.npy: a density grid as a dense array rho[nz][ny][nx] with an empty border of one
/// voxel, for renderers that do not read `.vdb`. Prints where it lies as JSON: the world-space position of
/// voxel (0, 0, 0) and the edge of a voxel, in metres.
#include <cstdio>

#include "bench/peers/dense_grid.h"
#include "bench/peers/npy.h"

int main(int argc, char** argv) try {
  using namespace pileus::bench;
  if (argc != 3) return std::fputs("usage: vdb_to_npy CLOUD.vdb RHO.npy\n", stderr), 2;
  const DenseGrid grid = read_dense_grid(argv[1]);
  write_npy(argv[2], grid.rho, {grid.size.z, grid.size.y, grid.size.x});
  std::printf("{\"origin\": [%.17g, %.17g, %.17g], \"voxel_size\": %.17g}\n", grid.origin.x, grid.origin.y,
              grid.origin.z, grid.voxel_size);
} catch (const std::exception& error) {
  std::fprintf(stderr, "vdb_to_npy: %s\n", error.what());
  return 1;
}
