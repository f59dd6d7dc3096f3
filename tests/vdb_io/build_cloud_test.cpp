#include "vdb_io/openvdb/build_cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lib/cloud/cloud_presets.h"
#include "lib/cloud/cloud_region.h"
#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "lib/core/parallel.h"
#include "lib/freeform/shapes.h"
#include "tests/fixtures/random_clouds.h"

namespace pileus {
namespace {

ProceduralCloud small_cloud(const Vec3d& center = {0.3, 1.6, -0.1}) {
  const FreeForm form = ellipsoid(center, {3, 1.6, 2.2});
  return {CloudRecipe{}, form};
}

CloudGridOptions voxels_of(double voxel_size) {
  CloudGridOptions options;
  options.voxel_size = voxel_size;
  return options;
}

/// Message of the Error that building throws, "" where it succeeds.
std::string refusal(const ProceduralCloud& cloud, const CloudGridOptions& options) {
  try {
    build_cloud(cloud, options);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    return error.what();
  }
  return "";
}

TEST(BuildCloud, holds_the_recipe_at_every_voxel) {
  const ProceduralCloud cloud = small_cloud();
  const double voxel_size = 0.1;
  const auto grid = build_cloud(cloud, voxels_of(voxel_size));
  const auto accessor = grid->getConstAccessor();
  int inside = 0;
  for (int x = -31; x <= 35; ++x) {
    for (int y = -1; y <= 33; ++y) {
      for (int z = -25; z <= 23; ++z) {
        const double expected = cloud.density(voxel_size * Vec3d(x, y, z));
        const openvdb::Coord voxel(x, y, z);
        ASSERT_NEAR(accessor.getValue(voxel), expected, 1e-3);
        ASSERT_EQ(accessor.isValueOn(voxel), accessor.getValue(voxel) > 0);
        inside += accessor.isValueOn(voxel);
      }
    }
  }
  EXPECT_GT(inside, 5000);
  EXPECT_EQ(grid->activeVoxelCount(), openvdb::Index64(inside)) << "nothing lies beyond the bounds";
}

TEST(BuildCloud, is_a_fog_volume_that_other_programs_understand) {
  const auto grid = build_cloud(small_cloud(), voxels_of(0.1));
  EXPECT_EQ(grid->getName(), "density");
  EXPECT_EQ(grid->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(grid->background(), 0.0f);
  EXPECT_EQ(grid->getCreator().substr(0, 7), "pileus ");
  EXPECT_EQ(grid->indexToWorld(openvdb::Coord(3, -2, 7)), openvdb::Vec3d(0.1 * 3, 0.1 * -2, 0.1 * 7));
}

TEST(BuildCloud, is_sparse) {
  CloudRecipe recipe;
  recipe.erosion = 0;  // a smooth solid: its core saturates
  const FreeForm form = ellipsoid({0, 0, 0}, {2, 2, 2});
  const auto grid = build_cloud({recipe, form}, voxels_of(0.04));
  EXPECT_GT(grid->tree().activeTileCount(), 0u);
  EXPECT_LT(grid->tree().leafCount(), 13u * 13u * 13u);
}

TEST(BuildCloud, does_not_depend_on_the_number_of_threads) {
  const ProceduralCloud cloud = small_cloud();
  std::vector<openvdb::FloatGrid::Ptr> grids;
  for (const int threads : {1, 2, 7}) {
    with_threads(threads, [&] { grids.push_back(build_cloud(cloud, voxels_of(0.06))); });
  }
  for (const auto& grid : grids) {
    ASSERT_TRUE(grid->tree().hasSameTopology(grids.front()->tree()));
    auto expected = grids.front()->cbeginValueAll();
    for (auto it = grid->cbeginValueAll(); it; ++it, ++expected)
      ASSERT_EQ(it.getValue(), expected.getValue());
  }
}

TEST(BuildCloud, refuses_a_grid_over_the_budget_and_names_a_voxel_size_that_fits) {
  EXPECT_EQ(refusal(small_cloud(), voxels_of(1e-9)),
            "error: voxel_size = 1e-09 m makes a grid of 8.45e+28 voxels; expected at most 536870912 "
            "(max_voxels); nearest voxel_size that fits: 0.0054 m");
  CloudGridOptions options = voxels_of(0.01);
  options.max_voxels = 1000;
  EXPECT_NE(refusal(small_cloud(), options).find("nearest voxel_size that fits: 0.47 m"), std::string::npos)
      << refusal(small_cloud(), options);
  options.voxel_size = 0.47;
  EXPECT_EQ(refusal(small_cloud(), options), "");
}

TEST(BuildCloud, refuses_voxel_sizes_that_are_none) {
  for (const double voxel_size : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_NE(refusal(small_cloud(), voxels_of(voxel_size)).find("expected a finite length > 0"),
              std::string::npos);
  }
  EXPECT_NE(refusal(small_cloud(), voxels_of(5e-324)), "");
}

/// The grid as it comes out where nothing is decided by bounds.
openvdb::FloatGrid::Ptr built_without_bounds(const ProceduralCloud& cloud, double voxel_size) {
  const auto grid = openvdb::FloatGrid::create(0.0f);
  const CloudRegion whole(cloud, cloud.bounds());
  const auto first = [&](int axis) { return int(std::floor(cloud.bounds().min[axis] / voxel_size / 8)) * 8; };
  std::array<float, 512> rho;
  for (int x = first(0); x * voxel_size <= cloud.bounds().max.x; x += 8) {
    for (int y = first(1); y * voxel_size <= cloud.bounds().max.y; y += 8) {
      for (int z = first(2); z * voxel_size <= cloud.bounds().max.z; z += 8) {
        openvdb::FloatTree::LeafNodeType leaf({x, y, z}, 0.0f);
        const Box3d box(voxel_size * Vec3d(x, y, z), voxel_size * Vec3d(x + 7, y + 7, z + 7));
        CloudRegion(cloud, box).densities({box.min, Vec3d(voxel_size), Vec3i(8)}, rho);
        for (openvdb::Index i = 0; i < 512; ++i) {
          if (rho[i] > 0) grid->tree().setValue(leaf.offsetToGlobalCoord(i), rho[i]);
        }
      }
    }
  }
  return grid;
}

TEST(BuildCloud, bounds_change_no_voxel) {
  RandomClouds random(31);
  for (int n = 0; n < 12; ++n) {
    const ProceduralCloud cloud(random.tame_recipe(), random.cloud_form());
    const double voxel_size = cloud.bounds().size().length() / 60;
    const auto grid = build_cloud(cloud, voxels_of(voxel_size));
    const auto expected = built_without_bounds(cloud, voxel_size);
    ASSERT_EQ(grid->activeVoxelCount(), expected->activeVoxelCount());
    const auto accessor = grid->getConstAccessor();
    for (auto voxel = expected->cbeginValueOn(); voxel; ++voxel) {
      ASSERT_EQ(accessor.getValue(voxel.getCoord()), *voxel);
    }
  }
}

/// The thinner the shell of voxels that bounds leave undecided, the more they decide: 512^3 is what counts,
/// and takes half a minute (PILEUS_SLOW_TESTS=1).
TEST(BuildCloud, bounds_decide_nine_of_ten_empty_voxels_of_every_preset) {
  const bool is_slow = std::getenv("PILEUS_SLOW_TESTS") != nullptr;
  const double edge = is_slow ? 512 : 192, least = is_slow ? 0.9 : 0.75;
  for (const std::string& name : cloud_preset_names()) {
    const ProceduralCloud cloud(cloud_preset(name), cloud_preset_form(name, {0.1, 0.2, 0.3}, {4, 4, 4}));
    CloudBuildCounters counters;
    const auto grid = build_cloud(cloud, voxels_of(cloud.bounds().size().x / edge), &counters);
    const int64_t empty = counters.voxels - int64_t(grid->activeVoxelCount());
    EXPECT_EQ(counters.empty_by_bound + counters.full_by_bound + counters.evaluated, counters.voxels);
    EXPECT_EQ(counters.empty_by_bound + counters.evaluated_empty, empty);
    EXPECT_GE(counters.share_of_empty_by_bound(), least) << name;
  }
}

TEST(BuildCloud, keeps_to_a_number_of_voxels_or_bytes) {
  const ProceduralCloud cloud = small_cloud();
  CloudGridOptions options;
  options.max_voxels = 1'000'000;
  const auto by_voxels = build_cloud(cloud, options);
  const Vec3d size = cloud.bounds().size() / by_voxels->voxelSize().x();
  EXPECT_LT(size.x * size.y * size.z, 1.05e6);
  EXPECT_GT(size.x * size.y * size.z, 0.8e6);

  options = {};
  options.max_bytes = 3'000'000;
  const auto by_bytes = build_cloud(cloud, options);
  EXPECT_LE(by_bytes->memUsage(), 3'000'000u);
  EXPECT_GT(by_bytes->memUsage(), 1'200'000u);

  options = voxels_of(0.01);
  options.max_bytes = 3'000'000;
  EXPECT_NE(refusal(cloud, options).find("expected at most 3 MB (max_bytes); nearest voxel_size that fits"),
            std::string::npos);
  options = {};
  options.max_bytes = 1000;
  EXPECT_NE(refusal(cloud, options).find("no grid of the cloud is as small as 1 kB (max_bytes)"),
            std::string::npos);
}

/// A budget for the time of a test.
struct MemoryBudget {
  explicit MemoryBudget(uint64_t bytes) { set_memory_budget(bytes); }
  ~MemoryBudget() { set_memory_budget(0); }
};

TEST(BuildCloud, keeps_to_the_memory_budget) {
  const MemoryBudget budget(2'000'000);
  const std::string told = refusal(small_cloud(), voxels_of(0.02));
  EXPECT_NE(told.find("voxel_size = 0.02 m makes a grid of "), std::string::npos) << told;
  EXPECT_NE(told.find("expected at most 2 MB (the memory budget); nearest voxel_size that fits: "),
            std::string::npos)
      << told;
  EXPECT_NE(told.find("; or allow more with --memory "), std::string::npos) << told;

  const std::string fits = "that fits: ";
  const double voxel_size = std::stod(told.substr(told.find(fits) + fits.size()));
  const auto grid = build_cloud(small_cloud(), voxels_of(voxel_size));
  EXPECT_LE(grid->memUsage(), 2'000'000u);
  EXPECT_GT(grid->memUsage(), 500'000u) << "the hint wastes most of the budget";

  CloudGridOptions by_limit;
  by_limit.max_voxels = 20'000'000;
  EXPECT_NE(refusal(small_cloud(), by_limit).find(" m, the smallest that the limits allow, makes a grid of "),
            std::string::npos);
  by_limit.max_bytes = 1'000'000'000;
  EXPECT_NE(refusal(small_cloud(), by_limit).find("(the memory budget)"), std::string::npos);
}

TEST(BuildCloud, refuses_every_grid_that_takes_more_memory_than_the_budget) {
  RandomClouds random(77);
  int grids = 0;
  for (int n = 0; n < 12; ++n) {
    const ProceduralCloud cloud(random.tame_recipe(), random.cloud_form());
    const Vec3d extent = cloud.bounds().size();
    const double coarse = extent.length() / 30;
    if (std::min({extent.x, extent.y, extent.z}) < 2 * coarse) continue;
    for (double voxel_size = coarse; voxel_size > coarse / 3; voxel_size *= 0.7) {
      const auto grid = build_cloud(cloud, voxels_of(voxel_size));
      if (grid->tree().leafCount() == 0) continue;
      const MemoryBudget budget(grid->memUsage() - 2000);  // what the tree takes beside its nodes
      EXPECT_NE(refusal(cloud, voxels_of(voxel_size)), "") << grid->memUsage();
      ++grids;
    }
  }
  EXPECT_GT(grids, 10);
}

TEST(BuildCloud, refuses_at_once_what_would_take_terabytes) {
  for (const Vec3d& radii : {Vec3d(3, 2, 3), Vec3d(3000, 0.002, 3000)}) {
    CloudGridOptions options;
    options.max_voxels = 1'000'000'000'000;
    const MemoryBudget budget(1'000'000'000);
    const ProceduralCloud cloud{CloudRecipe{}, ellipsoid({0, 0, 0}, radii)};
    const std::clock_t start = std::clock();
    EXPECT_NE(refusal(cloud, options).find("the memory budget"), std::string::npos)
        << refusal(cloud, options);
    EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, 10.0) << "seconds of processor time";
  }
}

TEST(BuildCloud, refuses_voxels_so_large_that_none_is_inside) {
  EXPECT_NE(refusal(small_cloud({50, 50, 50}), voxels_of(80)).find("no voxel of size 80 m lies in"),
            std::string::npos);
}

TEST(BuildCloud, refuses_what_is_too_far_out_or_has_no_size) {
  EXPECT_NE(refusal(small_cloud({1e9, 0, 0}), voxels_of(0.1)).find("too far out"), std::string::npos);
  EXPECT_NE(refusal(small_cloud({1e300, 0, 0}), voxels_of(0.1)), "");
  const FreeForm endless = ellipsoid({0, 0, 0}, {1e308, 1e308, 1e308});
  EXPECT_NE(refusal({CloudRecipe{}, endless}, voxels_of(0.1)).find("expected finite lengths"),
            std::string::npos);
}

TEST(BuildCloud, reports_progress_that_rises_to_one) {
  CloudGridOptions options = voxels_of(0.04);
  std::vector<double> shares;
  options.progress = [&](double share) {
    shares.push_back(share);
    return true;
  };
  build_cloud(small_cloud(), options);
  ASSERT_GT(shares.size(), 10u);
  for (size_t i = 1; i < shares.size(); ++i) EXPECT_LT(shares[i - 1], shares[i]);
  EXPECT_EQ(shares.back(), 1.0);
}

TEST(BuildCloud, can_be_cancelled) {
  CloudGridOptions options = voxels_of(0.1);
  options.progress = [](double share) { return share < 0.3; };
  try {
    build_cloud(small_cloud(), options);
    FAIL() << "not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::cancelled);
  }
}

}  // namespace
}  // namespace pileus
