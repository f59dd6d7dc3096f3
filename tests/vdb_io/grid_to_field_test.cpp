#include "vdb_io/openvdb/grid_to_field.h"

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "tests/vdb_io/vdb_test_files.h"
#include "vdb_io/openvdb/vdb_reader.h"

namespace pileus {
namespace {

using openvdb::Coord;

/// Trilinear interpolation of what the grid's getValue says: the definition of the density, in double.
double reference_density(const openvdb::FloatGrid& grid, const Vec3d& p) {
  const auto accessor = grid.getConstAccessor();
  const Vec3i base(int(std::floor(p.x)), int(std::floor(p.y)), int(std::floor(p.z)));
  double rho = 0.0;
  for (int n = 0; n < 8; ++n) {
    double weight = 1.0;
    Coord corner;
    for (int axis = 0; axis < 3; ++axis) {
      const int offset = n >> axis & 1;
      const double fraction = p[axis] - base[axis];
      weight *= offset == 1 ? fraction : 1.0 - fraction;
      corner[axis] = base[axis] + offset;
    }
    rho += weight * double(accessor.getValue(corner));
  }
  return rho;
}

/// Compares field and grid along random rays through the box; the ray's points are pulled back to index
/// space.
void expect_same_density(const openvdb::FloatGrid& grid, const DensityField& field,
                         const Affine& world_from_index, const Vec3d& lo, const Vec3d& hi) {
  const Affine index_from_world = world_from_index.inverse();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto point = [&] {
    return Vec3d(lo.x + unit(random) * (hi.x - lo.x), lo.y + unit(random) * (hi.y - lo.y),
                 lo.z + unit(random) * (hi.z - lo.z));
  };
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const Vec3d from = world_from_index.point(point()), to = world_from_index.point(point());
    const Ray ray{from, normalize(to - from)};
    constexpr int kSamples = 200;
    const double dt = length(to - from) / kSamples;
    std::array<double, kSamples> rho;
    FieldCounters counters;
    field.sample(ray, 0.0, dt, rho, counters);
    for (int k = 0; k < kSamples; ++k) {
      const double expected = reference_density(grid, index_from_world.point(ray.at(k * dt)));
      hits += expected > 0.0 ? 1 : 0;
      ASSERT_NEAR(rho[size_t(k)], expected, 1e-6 * std::max(1.0, expected));
    }
  }
  EXPECT_GT(hits, 100) << "the rays miss the density: nothing was compared";
}

TEST(FieldFromGrid, is_the_trilinear_interpolation_of_the_grid) {
  auto grid = make_grid();
  std::mt19937 random(5);
  std::uniform_int_distribution<int> place(-20, 20);
  for (int i = 0; i < 4000; ++i) {
    const Coord p(place(random), place(random), place(random));
    grid->tree().setValueOn(p, float(1 + random() % 7));
  }
  expect_same_density(*grid, *field_from_grid(grid, Affine()), Affine(), Vec3d(-24.0), Vec3d(24.0));
}

TEST(FieldFromGrid, interpolates_across_node_borders_on_every_side) {
  // A voxel in the lowest corner of its leaf, of its nodes and of the root's octant: its cells lie in others.
  for (const Coord& corner : {Coord(0), Coord(8), Coord(-128, 0, 128), Coord(4096)}) {
    auto grid = make_grid();
    grid->tree().setValueOn(corner, 1.0f);
    const Vec3d center(corner.x(), corner.y(), corner.z());
    expect_same_density(*grid, *field_from_grid(grid, Affine()), Affine(), center - Vec3d(1.5),
                        center + Vec3d(1.5));
  }
}

TEST(FieldFromGrid, sees_tiles_and_inactive_values) {
  auto grid = make_grid();
  grid->tree().addTile(1, Coord(0), 2.0f, true);
  grid->tree().addTile(1, Coord(8, 0, 0), 3.0f, false);
  grid->tree().setValueOff(Coord(3, -1, 3), 5.0f);
  expect_same_density(*grid, *field_from_grid(grid, Affine()), Affine(), Vec3d(-3.0), Vec3d(18.0));
}

TEST(FieldFromGrid, surrounds_large_tiles) {
  auto grid = make_grid();
  grid->tree().addTile(2, Coord(128), 1.5f, true);
  expect_same_density(*grid, *field_from_grid(grid, Affine()), Affine(), Vec3d(120.0), Vec3d(264.0));
}

TEST(FieldFromGrid, placement_comes_on_top_of_the_grids_transform) {
  auto grid = make_grid();
  for (int i = 0; i < 12; ++i) grid->tree().setValueOn(Coord(i, 2 * i, -i), 1.0f + float(i));
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  matrix.preRotate(openvdb::math::Y_AXIS, 0.7);
  matrix.preScale(openvdb::Vec3d(0.1, 0.2, 0.4));
  matrix.setTranslation(openvdb::Vec3d(1000.0, -5.0, 3.0));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  const Affine placement = Affine::translation({10, 0, 0}) * Affine::scaling({2, 1, 1});
  const auto field = field_from_grid(grid, placement);
  const Affine world = placement * world_from_index({}, *grid);
  expect_same_density(*grid, *field, world, Vec3d(-1.0, -1.0, -13.0), Vec3d(13.0, 25.0, 1.0));
}

TEST(FieldFromGrid, leaves_the_callers_grid_alone) {
  auto grid = make_grid();
  grid->tree().setValueOn(Coord(0), 1.0f);
  grid->tree().setValueOff(Coord(64), 1.0f);
  field_from_grid(grid, Affine());
  EXPECT_EQ(grid->tree().leafCount(), 2u);
  EXPECT_EQ(grid->activeVoxelCount(), 1u);
}

TEST(FieldFromGrid, a_grid_of_zeros_is_a_field_of_zeros) {
  const auto grid = make_grid();
  const auto field = field_from_grid(grid, Affine());
  EXPECT_EQ(field->max_density(), 0.0);
  EXPECT_TRUE(std::isfinite(field->bounds().min.x) && std::isfinite(field->bounds().max.x));
}

TEST(FieldFromGrid, refuses_more_tile_surface_than_memory) {
  auto grid = make_grid();
  for (int i = 0; i < 4000; ++i) grid->tree().addTile(3, Coord(8192 * i, 0, 0), 1.0f, true);
  expect_mentions(error_of([&] { field_from_grid(grid, Affine())->bricks(); }), "bricks need");
}

TEST(FieldFromGrid, shows_a_real_cloud) {
  PILEUS_REAL_FILE(path, "vdb/dragon.vdb");
  const auto grid = read_density_grid(path).grid;
  const auto box = grid->evalActiveVoxelBoundingBox();
  const Vec3d lo(box.min().x() - 1, box.min().y() - 1, box.min().z() - 1);
  const Vec3d hi(box.max().x() + 1, box.max().y() + 1, box.max().z() + 1);
  const auto field = field_from_grid(grid, Affine());
  expect_same_density(*grid, *field, world_from_index(path, *grid), lo, hi);
  EXPECT_NEAR(field->max_density(), 1.0, 1e-6);
}

}  // namespace
}  // namespace pileus
