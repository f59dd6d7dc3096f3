#include "lib/volume/brick_pyramid.h"

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "tests/fixtures/voxel_sources.h"

namespace pileus {
namespace {

const ValueRange& range_at(const BrickPyramid::Level& level, int x, int y, int z) {
  return level.ranges[(size_t(x) * size_t(level.nodes.y) + size_t(y)) * size_t(level.nodes.z) + size_t(z)];
}

template <class Visit>
void for_each_node(const Vec3i& nodes, Visit&& visit) {
  for (int x = 0; x < nodes.x; ++x) {
    for (int y = 0; y < nodes.y; ++y) {
      for (int z = 0; z < nodes.z; ++z) visit(x, y, z);
    }
  }
}

TEST(BrickPyramid, each_level_is_the_union_of_the_finer_one) {
  const BrickGrid grid = mixed_voxels(11).build();
  const BrickPyramid pyramid(grid);
  ASSERT_GE(pyramid.levels().size(), 2u);
  EXPECT_EQ(pyramid.levels().back().nodes, Vec3i(1));
  EXPECT_EQ(pyramid.levels().back().ranges[0].hi, grid.max_value());
  for (size_t l = 1; l < pyramid.levels().size(); ++l) {
    const BrickPyramid::Level &coarse = pyramid.levels()[l], &fine = pyramid.levels()[l - 1];
    std::vector<ValueRange> expected(coarse.ranges.size(), {1e30f, -1e30f});
    for_each_node(fine.nodes, [&](int x, int y, int z) {
      const size_t parent =
          (size_t(x / 2) * size_t(coarse.nodes.y) + size_t(y / 2)) * size_t(coarse.nodes.z) + size_t(z / 2);
      ASSERT_LT(parent, expected.size());
      expected[parent].include(range_at(fine, x, y, z));
    });
    for (size_t n = 0; n < expected.size(); ++n) {
      ASSERT_EQ(coarse.ranges[n].lo, expected[n].lo) << "level " << l;
      ASSERT_EQ(coarse.ranges[n].hi, expected[n].hi) << "level " << l;
    }
  }
}

TEST(BrickPyramid, its_table_finds_the_grids_values_and_zeros_all_around) {
  for (const unsigned seed : {12u, 13u}) {
    VoxelSources voxels = mixed_voxels(seed);
    const BrickGrid grid = voxels.build();
    const BrickPyramid pyramid(grid);
    const BrickPyramid::Level& bricks = pyramid.levels().front();
    for_each_node(bricks.nodes, [&](int x, int y, int z) {
      const Vec3i cell = pyramid.origin() + Vec3i(x, y, z) * 8;
      const size_t at = (size_t(x) * size_t(bricks.nodes.y) + size_t(y)) * size_t(bricks.nodes.z) + size_t(z);
      const float* values = grid.all_values().data() + pyramid.offsets()[at];
      const BrickGrid::Block* block = grid.block_at(cell);
      if (!block) {
        ASSERT_EQ(values[0], 0.0f);
        ASSERT_EQ(values[728], 0.0f);
        ASSERT_EQ(bricks.ranges[at].hi, 0.0f);
      } else {
        ASSERT_EQ(values, grid.values(grid.brick_at(*block, cell)));
        ASSERT_EQ(bricks.ranges[at].hi, grid.brick_at(*block, cell).range.hi);
        ASSERT_EQ(bricks.ranges[at].lo, grid.brick_at(*block, cell).range.lo);
      }
      const bool is_border = x == 0 || y == 0 || z == 0 || x == bricks.nodes.x - 1 ||
                             y == bricks.nodes.y - 1 || z == bricks.nodes.z - 1;
      if (is_border) {
        for (int n = 0; n < BrickGrid::kValues; ++n) ASSERT_EQ(values[n], 0.0f) << cell;
      }
    });
    // All that is not 0 lies inside, by a brick at least.
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LE(pyramid.origin()[axis], grid.lo()[axis] - 8);
      EXPECT_GE(pyramid.origin()[axis] + 8 * bricks.nodes[axis], grid.hi()[axis] + 8);
    }
  }
}

TEST(BrickPyramid, does_not_depend_on_threads) {
  const BrickGrid grid = mixed_voxels(14).build();
  const BrickPyramid reference(grid);
  for (const int threads : {1, 7}) {
    with_threads(threads, [&] {
      const BrickPyramid pyramid(grid);
      EXPECT_EQ(pyramid.offsets(), reference.offsets());
      ASSERT_EQ(pyramid.levels().size(), reference.levels().size());
    });
  }
}

TEST(BrickPyramid, an_empty_grid_has_one) {
  const BrickGrid grid = build_brick_grid({}, {});
  const BrickPyramid pyramid(grid);
  EXPECT_GE(pyramid.levels().size(), 2u);
  EXPECT_EQ(pyramid.levels().back().ranges[0].hi, 0.0f);
}

TEST(BrickPyramid, grids_that_span_too_much_are_an_error) {
  const auto pair = [](const Vec3i& a, const Vec3i& b) {
    VoxelSources voxels;
    voxels.set(a, 1.0f);
    voxels.set(b, 1.0f);
    const BrickGrid grid = voxels.build();
    return BrickPyramid(grid).levels().size();
  };
  EXPECT_GT(pair({0, 0, 0}, {3000, 3000, 3000}), 8u);
  EXPECT_GT(pair({0, 0, 0}, {1 << 21, 0, 0}), 8u) << "long, and thin";
  EXPECT_THROW(pair({0, 0, 0}, {4000, 4000, 4000}), Error);
  EXPECT_THROW(pair({0, 0, 0}, {1000000, 1000000, 1000000}), Error);
  for (int axis = 0; axis < 3; ++axis) {
    Vec3i far(0);
    far[axis] = 1 << 30;
    EXPECT_THROW(pair(far, far), Error);
    far[axis] = -(1 << 30) - 1;
    EXPECT_THROW(pair(far, far), Error);
    EXPECT_THROW(pair(-far, far), Error);
    far[axis] = std::numeric_limits<int>::min();
    EXPECT_THROW(pair(far, far), Error);
    far[axis] = std::numeric_limits<int>::max();
    EXPECT_THROW(pair(far, far), Error);
  }
}

}  // namespace
}  // namespace pileus
