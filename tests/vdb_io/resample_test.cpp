#include "vdb_io/openvdb/resample.h"

#include <cmath>

#include "lib/core/memory_budget.h"
#include "tests/vdb_io/vdb_test_files.h"

namespace pileus {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;

double sum_of(const FloatGrid& grid) {
  double sum = 0.0;
  for (auto value = grid.cbeginValueOn(); value; ++value)
    sum += double(*value) * double(value.getVoxelCount());
  const openvdb::Vec3d edges = grid.voxelSize();
  return sum * edges.x() * edges.y() * edges.z();
}

FloatGrid::Ptr resampled(const FloatGrid& grid, const NewVoxels& voxels) {
  return openvdb::gridPtrCast<FloatGrid>(resampled_grid("a.vdb", grid, voxels));
}

TEST(ResampledGrid, of_twice_the_edge_averages_eight_voxels) {
  const auto grid = scattered_voxels();
  const auto half = resampled(*grid, VoxelFactor{2});
  EXPECT_EQ(half->voxelSize(), openvdb::Vec3d(1.0));
  int compared = 0;
  for (int x = -6; x <= 13; ++x) {
    for (int y = -6; y <= 7; ++y) {
      for (int z = -6; z <= 7; ++z) {
        double sum = 0.0;
        for (int n = 0; n < 8; ++n) {
          sum +=
              double(grid->tree().getValue(Coord(2 * x + (n & 1), 2 * y + (n >> 1 & 1), 2 * z + (n >> 2))));
        }
        ASSERT_NEAR(half->tree().getValue(Coord(x, y, z)), sum / 8, 1e-6);
        compared += sum > 0 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(compared, 500);
  // The cell of voxel 0 still begins at the same corner.
  EXPECT_EQ(half->indexToWorld(openvdb::Vec3d(-0.5)), grid->indexToWorld(openvdb::Vec3d(-0.5)));
}

TEST(ResampledGrid, keeps_the_integral_over_space) {
  const auto grid = scattered_voxels();
  for (const double factor : {2.0, 3.0, 4.0, 1.0}) {
    EXPECT_NEAR(sum_of(*resampled(*grid, VoxelFactor{factor})), sum_of(*grid), 1e-5 * sum_of(*grid))
        << factor;
  }
  EXPECT_NEAR(sum_of(*resampled(*grid, VoxelEdge{1.3})), sum_of(*grid), 1e-5 * sum_of(*grid));
}

TEST(ResampledGrid, of_smaller_voxels_is_the_trilinear_density) {
  const auto grid = make_grid();
  grid->tree().setValueOn(Coord(0), 8.0f);
  const auto fine = resampled(*grid, VoxelFactor{0.5});
  // New voxel i lies at 0.5 * (i + 0.5) - 0.5 in old ones.
  for (int x = -3; x <= 4; ++x) {
    const double old = 0.5 * (x + 0.5) - 0.5;
    const double tent = std::max(0.0, 1 - std::abs(old));
    EXPECT_NEAR(fine->tree().getValue(Coord(x, 0, 1)), 8.0 * tent * 0.75 * 0.75, 1e-6) << x;
  }
}

TEST(ResampledGrid, by_one_changes_nothing) {
  const auto grid = scattered_voxels();
  const auto same = resampled(*grid, VoxelEdge{0.5});
  for (auto value = grid->cbeginValueOn(); value; ++value) {
    ASSERT_EQ(same->tree().getValue(value.getCoord()), *value);
  }
  EXPECT_EQ(same->activeVoxelCount(), grid->activeVoxelCount());
}

TEST(ResampledGrid, keeps_a_level_set_closed) {
  initialize_openvdb();
  auto grid = FloatGrid::create(1.5f);
  for (int x = -14; x <= 14; ++x) {
    for (int y = -14; y <= 14; ++y) {
      for (int z = -14; z <= 14; ++z) {
        const double distance = 0.5 * (std::sqrt(double(x * x + y * y + z * z)) - 10);
        if (std::abs(distance) < 1.5) grid->tree().setValueOn(Coord(x, y, z), float(distance));
        if (distance <= -1.5) grid->tree().setValueOff(Coord(x, y, z), -1.5f);
      }
    }
  }
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  const auto coarse = resampled(*grid, VoxelEdge{0.75});
  EXPECT_EQ(coarse->getGridClass(), openvdb::GRID_LEVEL_SET);
  EXPECT_LT(coarse->tree().getValue(Coord(0)), 0.0f) << "inside";
  EXPECT_EQ(coarse->tree().getValue(Coord(40, 0, 0)), 1.5f) << "outside";
  for (auto value = coarse->cbeginValueOn(); value; ++value) {
    const double distance = coarse->indexToWorld(value.getCoord()).length() - 5.0;
    if (std::abs(distance) < 0.7) {  // beyond, a mean has some of the background in it
      ASSERT_NEAR(*value, distance, 0.1);
    }
  }
}

TEST(ResampledGrid, takes_whole_numbers_from_the_nearest_voxel) {
  auto grid = make_grid<openvdb::Int32Grid>("flags", openvdb::GRID_UNKNOWN);
  grid->tree().setValueOn(Coord(0), 6);
  const auto fine =
      openvdb::gridPtrCast<openvdb::Int32Grid>(resampled_grid("a.vdb", *grid, VoxelFactor{0.5}));
  EXPECT_EQ(fine->activeVoxelCount(), 8u);
  EXPECT_EQ(fine->tree().getValue(Coord(1, 0, 1)), 6);
}

TEST(ResampledGrid, centres_staggered_vectors) {
  auto grid = make_grid<openvdb::Vec3SGrid>("vel", openvdb::GRID_STAGGERED);
  // x components stand half a voxel below the centre: (1 + 3) / 2 at the centre of voxel 0.
  grid->tree().setValueOn(Coord(0), openvdb::Vec3s(1, 0, 0));
  grid->tree().setValueOn(Coord(1, 0, 0), openvdb::Vec3s(3, 0, 0));
  const auto centred =
      openvdb::gridPtrCast<openvdb::Vec3SGrid>(resampled_grid("a.vdb", *grid, VoxelFactor{1}));
  EXPECT_EQ(centred->getGridClass(), openvdb::GRID_UNKNOWN);
  EXPECT_FLOAT_EQ(centred->tree().getValue(Coord(0)).x(), 2.0f);
}

TEST(ResampledGrid, far_coarser_ones_take_no_longer_and_keep_the_integral) {
  auto grid = make_grid();
  grid->tree().fill(openvdb::CoordBBox(Coord(-40), Coord(59)), 1.0f, true);
  grid->tree().voxelizeActiveTiles();
  for (const double factor : {5.0, 37.0, 1000.0}) {
    EXPECT_NEAR(sum_of(*resampled(*grid, VoxelFactor{factor})), sum_of(*grid), 1e-5 * sum_of(*grid))
        << factor;
  }
}

TEST(ResampledGrid, refuses_what_would_not_fit) {
  auto grid = make_grid();
  grid->tree().addTile(3, Coord(0), 1.0f, true);
  set_memory_budget(1'000'000);
  expect_mentions(error_of([&] { resampled_grid("a.vdb", *grid, VoxelFactor{1}); }),
                  "on voxels of this size, needs");
  set_memory_budget(0);
  expect_mentions(error_of([&] { resampled_grid("a.vdb", *grid, VoxelFactor{1e-9}); }),
                  "expected 0.001 to 1000");
  expect_mentions(error_of([&] { resampled_grid("a.vdb", *grid, VoxelEdge{1e9}); }),
                  "expected 0.001 to 1000");
}

}  // namespace
}  // namespace pileus
