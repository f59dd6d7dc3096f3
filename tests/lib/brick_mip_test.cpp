#include "lib/volume/brick_mip.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "lib/core/parallel.h"
#include "tests/fixtures/blob_voxels.h"
#include "tests/fixtures/voxel_sources.h"

namespace pileus {
namespace {

/// The value of a grid's node.
double node(const BrickGrid& grid, const Vec3i& p) {
  const BrickGrid::Block* block = grid.block_at(p);
  if (!block) return 0.0;
  const float* values = grid.values(grid.brick_at(*block, p));
  return double(values[(p.x & 7) * BrickGrid::kStrideX + (p.y & 7) * BrickGrid::kStrideY + (p.z & 7)]);
}

/// The trilinear field of a grid.
double density(const BrickGrid& grid, const Vec3d& p) {
  const Vec3i cell(int(std::floor(p.x)), int(std::floor(p.y)), int(std::floor(p.z)));
  std::array<double, 8> corners;
  for (int n = 0; n < 8; ++n) corners[size_t(n)] = node(grid, cell + Vec3i(n & 1, n >> 1 & 1, n >> 2));
  const Vec3d q = p - Vec3d(cell);
  return double(reference::trilinear(corners, q.x, q.y, q.z));
}

template <class Visit>
void for_each_node(const Vec3i& lo, const Vec3i& hi, Visit&& visit) {
  for (int x = lo.x; x <= hi.x; ++x) {
    for (int y = lo.y; y <= hi.y; ++y) {
      for (int z = lo.z; z <= hi.z; ++z) visit(Vec3i(x, y, z));
    }
  }
}

/// Leaves on both sides of block borders and of zero, with tiles and single voxels beside them.
VoxelSources some_voxels(unsigned seed) {
  std::mt19937 random(seed);
  VoxelSources voxels;
  for (const Vec3i& leaf : {Vec3i(-16, -8, 0), Vec3i(-8, -8, 0), Vec3i(0, 0, 0), Vec3i(120, 0, 0),
                            Vec3i(128, 0, 8), Vec3i(120, 8, 0), Vec3i(0, 120, 0)})
    voxels.add_random_leaf(leaf, random, 0.4);
  voxels.add_tile({8, 0, 0}, 8, 0.75f);
  voxels.add_tile({16, 0, 0}, 8, 0.75f);
  voxels.add_tile({24, 0, 0}, 8, 0.75f);
  for (const int x : {63, 64, 127, 128, 135, 136}) voxels.set({x, 60, -77 + x % 3}, 0.5f);
  return voxels;
}

TEST(BrickMip, nodes_are_means_of_three_along_each_axis) {
  const VoxelSources voxels = some_voxels(1);
  const BrickGrid fine = voxels.build();
  const std::optional<BrickGrid> coarser = coarsen(fine);
  ASSERT_TRUE(coarser);
  for_each_node({-12, -12, -45}, {75, 70, 20}, [&](const Vec3i& p) {
    double expected = 0.0;
    for_each_node(Vec3i(-1), Vec3i(1), [&](const Vec3i& d) {
      const double weight = 1.0 / (4 << (std::abs(d.x) + std::abs(d.y) + std::abs(d.z))) / 2.0;
      expected += weight * double(voxels.at(p * 2 + d));
    });
    ASSERT_NEAR(node(*coarser, p), expected, 1e-6) << p;
    ASSERT_EQ(node(*coarser, p) > 0.0, expected > 0.0) << p;
  });
}

TEST(BrickMip, the_integral_stays) {
  const BrickGrid fine = some_voxels(2).build();
  const std::optional<BrickGrid> coarser = coarsen(fine);
  ASSERT_TRUE(coarser);
  const auto sum = [](const BrickGrid& grid) {
    double total = 0.0;
    for_each_node(grid.lo(), grid.hi(), [&](const Vec3i& p) { total += node(grid, p); });
    return total;
  };
  EXPECT_NEAR(8.0 * sum(*coarser), sum(fine), 1e-6 * sum(fine));
}

TEST(BrickMip, no_point_differs_by_more_than_it_says) {
  for (const unsigned seed : {3u, 4u}) {
    const VoxelSources voxels = some_voxels(seed);
    const BrickGrid fine = voxels.build();
    const std::optional<BrickGrid> coarser = coarsen(fine);
    ASSERT_TRUE(coarser);
    const LevelDifference said = compare_levels(fine, *coarser);
    std::mt19937 random(seed);
    const auto between = [&](double lo, double hi) {
      return std::uniform_real_distribution<double>(lo, hi)(random);
    };
    const auto difference = [&](const Vec3d& p) {
      return std::abs(density(fine, p) - density(*coarser, 0.5 * p));
    };
    double worst = 0.0;
    for (int n = 0; n < 100000; ++n) {
      const Vec3d p = n % 2 ? Vec3d(between(-20, 12), between(-12, 12), between(-4, 12))
                            : Vec3d(between(110, 140), between(-4, 20), between(-4, 20));
      worst = std::max(worst, difference(p));
    }
    EXPECT_LE(worst, said.largest * (1.0 + 1e-12));
    double at_nodes = 0.0, squares = 0.0, count = 0.0;
    for_each_node(fine.lo() - Vec3i(4), fine.hi() + Vec3i(4), [&](const Vec3i& p) {
      const double d = difference(Vec3d(p));
      at_nodes = std::max(at_nodes, d);
      squares += d * d;
      count += node(fine, p) > 0.0 || density(*coarser, 0.5 * Vec3d(p)) > 0.0 ? 1.0 : 0.0;
    });
    EXPECT_NEAR(said.largest, at_nodes, 1e-12) << "and some node does differ by so much";
    EXPECT_NEAR(said.mean_square, squares / count, 1e-9);
  }
}

TEST(BrickMip, a_smooth_grid_hardly_changes_and_takes_an_eighth) {
  VoxelSources voxels;
  for_each_voxel_of_blob({0, 0, 0}, {60, 50, 40}, [&](const Vec3i& p, float rho) { voxels.set(p, rho); });
  const BrickGrid fine = voxels.build();
  const std::optional<BrickGrid> coarser = coarsen(fine);
  ASSERT_TRUE(coarser);
  const double first = compare_levels(fine, *coarser).largest;
  EXPECT_LT(first, 0.01);
  EXPECT_LT(coarser->all_values().size(), fine.all_values().size() / 5);
  const std::optional<BrickGrid> coarsest = coarsen(*coarser);
  ASSERT_TRUE(coarsest);
  EXPECT_NEAR(compare_levels(*coarser, *coarsest).largest, 4.0 * first, 2.0 * first);
}

TEST(BrickMip, does_not_depend_on_threads) {
  const BrickGrid fine = some_voxels(5).build();
  const std::optional<BrickGrid> reference = coarsen(fine);
  const LevelDifference all = compare_levels(fine, *reference);
  for (const int threads : {1, 7}) {
    with_threads(threads, [&] {
      const std::optional<BrickGrid> other = coarsen(fine);
      EXPECT_TRUE(std::ranges::equal(other->all_values(), reference->all_values()));
      EXPECT_EQ(compare_levels(fine, *other).largest, all.largest);
      EXPECT_EQ(compare_levels(fine, *other).mean_square, all.mean_square);
    });
  }
}

TEST(BrickMip, there_is_none_of_a_large_box_of_one_value) {
  VoxelSources voxels;
  for_each_node(Vec3i(0), Vec3i(3), [&](const Vec3i& p) { voxels.add_tile(p * 128, 128, 0.5f); });
  EXPECT_FALSE(coarsen(voxels.build()));
}

TEST(BrickMip, of_nothing_is_nothing) {
  const std::optional<BrickGrid> coarser = coarsen(build_brick_grid({}, {}));
  ASSERT_TRUE(coarser);
  EXPECT_EQ(coarser->max_value(), 0.0f);
  EXPECT_EQ(compare_levels(build_brick_grid({}, {}), *coarser).largest, 0.0);
}

}  // namespace
}  // namespace pileus
