// own_grid: makes a grid with OpenVDB, and shows it to pileus.
#include <cstdio>

#include <openvdb/openvdb.h>

#include <vdb_io/openvdb/grid_to_field.h>

int main() {
  openvdb::initialize();
  const auto grid = openvdb::FloatGrid::create(0.0f);
  grid->tree().setValue({1, 2, 3}, 0.75f);
  const auto field = pileus::field_from_grid(grid, pileus::Affine());
  std::printf("%g\n", field->max_density());
  return 0;
}
