// 16-bit bricks against the voxels that they come from, on every instruction set.
#include "lib/volume/quantized_bricks.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/volume/grid_field.h"
#include "tests/fixtures/simd_targets.h"
#include "tests/fixtures/voxel_sources.h"

namespace pileus {
namespace {

float value_of(const QuantizedValues& values, int16_t stored) {
  return float(values.scale * (stored + QuantizedValues::kZero));
}

/// The bricks that voxels may reach, by index into the pyramid's table.
std::vector<char> bricks_near(const BrickPyramid& pyramid, const VoxelSource& voxels) {
  const Vec3i n = pyramid.levels().front().nodes;
  std::vector<char> is_near(pyramid.offsets().size(), 0);
  const auto add = [&](const Vec3i& origin, int size) {
    const Vec3i at = origin - pyramid.origin();
    for (int x = (at.x >> 3) - 1; x < (at.x + size) >> 3; ++x) {
      for (int y = (at.y >> 3) - 1; y < (at.y + size) >> 3; ++y) {
        for (int z = (at.z >> 3) - 1; z < (at.z + size) >> 3; ++z)
          is_near.at(size_t((x * n.y + y) * n.z + z)) = 1;
      }
    }
  };
  for (size_t i = 0; i < voxels.leaves().size(); ++i) {
    if (voxels.reached(i) != 0) add(voxels.leaves()[i].origin, 8);
  }
  for (const VoxelTile& tile : voxels.tiles()) add(tile.origin, tile.size);
  return is_near;
}

/// Checks the means of a brick of 9^3 values.
void expect_means(const int16_t* stored, const int16_t* means) {
  for (int n = 0; n < QuantizedValues::kMeansPitch; ++n) {
    const int x = n / 16, y = n / 4 % 4, z = n % 4;
    double sum = 0.0;
    for (int k = 0; k < 8; ++k)
      sum += stored[(2 * x + (k & 1)) * 81 + (2 * y + (k >> 1 & 1)) * 9 + 2 * z + (k >> 2)];
    ASSERT_LE(std::abs(means[n] - sum / 8.0), 0.5) << x << ' ' << y << ' ' << z;
  }
}

/// Checks the 9^3 values of every brick, that their range is exact, and that all else is 0.
void expect_voxels(const BrickPyramid& pyramid, const VoxelSources& voxels) {
  const QuantizedValues& values = *pyramid.quantized();
  const BrickPyramid::Level& bricks = pyramid.levels().front();
  const std::vector<char> is_near = bricks_near(pyramid, voxels.source());
  for (size_t at = 0; at < is_near.size(); ++at) {
    const ValueRange range = bricks.ranges[at];
    if (!is_near[at]) {
      ASSERT_EQ(pyramid.offsets()[at], 0);
      ASSERT_EQ(range.hi, 0.0f);
      continue;
    }
    const size_t y_count = size_t(bricks.nodes.y), z_count = size_t(bricks.nodes.z);
    const Vec3i place(int(at / z_count / y_count), int(at / z_count % y_count), int(at % z_count));
    const Vec3i cell = pyramid.origin() + 8 * place;
    const int16_t* stored = values.stored.get() + pyramid.offsets()[at];
    expect_means(stored, values.means.get() +
                             pyramid.offsets()[at] / QuantizedValues::kPitch * QuantizedValues::kMeansPitch);
    ValueRange found{std::numeric_limits<float>::infinity(), 0.0f};
    for (int n = 0; n < 729; ++n) {
      const Vec3i corner(n / 81, n / 9 % 9, n % 9);
      const float value = value_of(values, stored[n]), voxel = voxels.at(cell + corner);
      ASSERT_LE(std::abs(double(value) - double(voxel)), values.max_error) << cell << corner;
      if (voxel == 0.0f) {
        ASSERT_EQ(value, 0.0f) << cell << corner;
      }
      found.include({value, value});
    }
    ASSERT_EQ(range.lo, found.lo) << cell;
    ASSERT_EQ(range.hi, found.hi) << cell;
  }
  for (int n = 0; n < 729; ++n)
    ASSERT_EQ(values.stored[size_t(n)], -QuantizedValues::kZero) << "slot of zeros";
  expect_means(values.stored.get(), values.means.get());
}

/// A brick of zeros lies around all that is not 0.
void expect_border(const BrickPyramid& pyramid) {
  const Vec3i n = pyramid.levels().front().nodes;
  for (size_t at = 0; at < pyramid.offsets().size(); ++at) {
    const int x = int(at) / n.z / n.y, y = int(at) / n.z % n.y, z = int(at) % n.z;
    const bool is_border = x == 0 || y == 0 || z == 0 || x == n.x - 1 || y == n.y - 1 || z == n.z - 1;
    if (is_border) {
      ASSERT_EQ(pyramid.offsets()[at], 0);
    }
  }
}

TEST(QuantizedBricks, every_corner_of_a_mixture) {
  for_each_simd_target([&](const std::string& target) {
    SCOPED_TRACE(target);
    const VoxelSources voxels = mixed_voxels(51);
    const BrickPyramid pyramid = build_quantized_bricks(voxels.source());
    expect_voxels(pyramid, voxels);
    expect_border(pyramid);
  });
}

TEST(QuantizedBricks, random_leaves_side_by_side) {
  std::mt19937 random(52);
  for_each_simd_target([&](const std::string& target) {
    SCOPED_TRACE(target);
    VoxelSources voxels;
    for (int n = 0; n < 27; ++n) {
      if (n % 5 != 0) voxels.add_random_leaf(Vec3i(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1) * 8, random, 0.2);
    }
    expect_voxels(build_quantized_bricks(voxels.source()), voxels);
  });
}

TEST(QuantizedBricks, one_voxel_at_every_kind_of_place) {
  for_each_simd_target([&](const std::string& target) {
    for (const int x : {-8, -3, -1, 0, 5, 7}) {
      for (const int y : {-8, -1, 0, 7}) {
        for (const int z : {-8, -1, 0, 4, 7}) {
          VoxelSources voxels;
          voxels.set({x, y, z}, 0.7f);
          const BrickPyramid pyramid = build_quantized_bricks(voxels.source());
          SCOPED_TRACE(testing::Message() << target << ' ' << Vec3i(x, y, z));
          expect_voxels(pyramid, voxels);
          const auto at_face = [](int i) { return (i & 7) == 0 ? 2u : 1u; };
          const size_t bricks = at_face(x) * at_face(y) * at_face(z);
          EXPECT_EQ(pyramid.quantized()->count, (bricks + 1) * size_t(QuantizedValues::kPitch));
        }
      }
    }
  });
}

TEST(QuantizedBricks, have_the_bounds_and_the_table_of_the_float_bricks) {
  VoxelSources voxels = mixed_voxels(53);
  const BrickGrid grid = voxels.build();
  const BrickPyramid floats(grid), pyramid = build_quantized_bricks(voxels.source());
  EXPECT_EQ(pyramid.lo(), grid.lo());
  EXPECT_EQ(pyramid.hi(), grid.hi());
  EXPECT_EQ(pyramid.origin(), floats.origin());
  ASSERT_EQ(pyramid.levels().size(), floats.levels().size());
  const double error = pyramid.quantized()->max_error;
  for (size_t l = 0; l < floats.levels().size(); ++l) {
    const auto &own = pyramid.levels()[l].ranges, &exact = floats.levels()[l].ranges;
    ASSERT_EQ(own.size(), exact.size());
    for (size_t n = 0; n < own.size(); ++n) {
      ASSERT_NEAR(double(own[n].lo), double(exact[n].lo), error);
      ASSERT_NEAR(double(own[n].hi), double(exact[n].hi), error);
    }
  }
}

TEST(QuantizedBricks, tiles_share_their_values_and_stay_uniform) {
  VoxelSources voxels;
  voxels.add_tile({0, 0, 0}, 128, 0.3f);
  voxels.add_tile({128, 0, 0}, 128, 0.3f);
  voxels.add_tile({256, 0, 0}, 128, 0.6f);
  const BrickPyramid pyramid = build_quantized_bricks(voxels.source());
  expect_voxels(pyramid, voxels);
  const ValueRange& inside = pyramid.range(2, Vec3i(64) - pyramid.origin());
  EXPECT_TRUE(inside.is_uniform());
  EXPECT_NEAR(double(inside.lo), 0.3, pyramid.quantized()->max_error);
  const size_t faces = pyramid.quantized()->count / size_t(QuantizedValues::kPitch);
  EXPECT_LT(faces, size_t(3 * 6 * 17 * 17));
}

TEST(QuantizedBricks, voxels_far_apart) {
  VoxelSources voxels;
  voxels.set({-900, 40, 7}, 1.0f);
  voxels.set({900, 40, 7}, 0.5f);
  voxels.set({0, -700, 300}, 0.25f);
  const BrickPyramid pyramid = build_quantized_bricks(voxels.source());
  expect_voxels(pyramid, voxels);
  EXPECT_EQ(pyramid.quantized()->count, size_t(7 * QuantizedValues::kPitch));

  voxels.set({40000, 40000, 40000}, 1.0f);
  EXPECT_THROW(build_quantized_bricks(voxels.source()), Error);
}

TEST(QuantizedBricks, nothing_at_all) {
  VoxelSources empty, zeros;
  zeros.set({3, 4, 5}, 0.0f);
  for (const VoxelSources* voxels : {&empty, &zeros}) {
    const BrickPyramid pyramid = build_quantized_bricks(voxels->source());
    EXPECT_EQ(pyramid.lo(), pyramid.hi());
    EXPECT_EQ(pyramid.levels().back().ranges[0].hi, 0.0f);
    expect_voxels(pyramid, *voxels);
  }
}

TEST(QuantizedBricks, steps_reach_the_largest_value_and_make_floats) {
  std::mt19937 random(54);
  std::uniform_real_distribution<double> exponent(-99.0, 126.0);
  for (int n = 0; n < 10000; ++n) {
    const float max = float(std::exp2(exponent(random)));
    const double scale = quantization_scale(max);
    ASSERT_GE(65535.0 * scale, double(max));
    ASSERT_LE(65535.0 * scale, double(max) * (1.0 + 1.0 / 127.0));
    const double value = scale * double(random() % 65536);
    ASSERT_EQ(double(float(value)), value) << max;
  }
  EXPECT_EQ(quantization_scale(0.0f), 1.0);
  EXPECT_EQ(quantization_scale(1e-38f), 0.0);
  EXPECT_EQ(quantization_scale(std::numeric_limits<float>::max()), 0.0);
}

TEST(QuantizedBricks, values_of_all_sizes) {
  for (const float most : {1e-29f, 1e-9f, 3.0f, 65535.0f, 1e38f}) {
    VoxelSources voxels;
    for (int n = 0; n < 512; ++n) voxels.set({n >> 6, n >> 3 & 7, n & 7}, most * (float(n) / 511.0f));
    voxels.set({9, 0, 0}, std::numeric_limits<float>::denorm_min());
    expect_voxels(build_quantized_bricks(voxels.source()), voxels);
  }
}

TEST(QuantizedBricks, say_how_much_neighbours_err_alike) {
  std::mt19937 random(55);
  VoxelSources constant, varied;
  for (int n = 0; n < 512; ++n) constant.set({n >> 6, n >> 3 & 7, n & 7}, 0.30001f);
  constant.set({64, 64, 64}, 1.0f);
  for (int n = 0; n < 8; ++n) varied.add_random_leaf(Vec3i(n & 1, n >> 1 & 1, n >> 2) * 8, random, 0.0);
  const BrickPyramid alike = build_quantized_bricks(constant.source()),
                     random_errors = build_quantized_bricks(varied.source());
  const QuantizedValues& one = *alike.quantized();
  const double error = std::abs(0.30001 - one.scale * std::nearbyint(0.30001 / one.scale));
  // Of the bricks: that of the leaf; seven below it, which read some of its values but hold none of the
  // voxels.
  EXPECT_NEAR(one.mean_error,
              (error + std::abs(1.0 - one.scale * std::nearbyint(1.0 / one.scale)) / 512) / 16, 1e-8);
  EXPECT_LT(random_errors.quantized()->mean_error, 0.05 * random_errors.quantized()->max_error);
  EXPECT_GT(random_errors.quantized()->mean_error, 0.0);
}

TEST(QuantizedBricks, order_and_threads_change_nothing) {
  VoxelSources voxels = mixed_voxels(56);
  const BrickPyramid reference = build_quantized_bricks(voxels.source());
  std::mt19937 random(57);
  for (const int threads : {1, 2, 7}) {
    std::shuffle(voxels.leaves().begin(), voxels.leaves().end(), random);
    std::shuffle(voxels.tiles().begin(), voxels.tiles().end(), random);
    with_threads(threads, [&] {
      const BrickPyramid pyramid = build_quantized_bricks(voxels.source());
      EXPECT_EQ(pyramid.offsets(), reference.offsets());
      const QuantizedValues &one = *pyramid.quantized(), &other = *reference.quantized();
      ASSERT_EQ(one.count, other.count);
      EXPECT_EQ(std::memcmp(one.stored.get(), other.stored.get(), one.count * sizeof(int16_t)), 0);
      EXPECT_EQ(one.mean_error, other.mean_error);
      EXPECT_EQ(one.mean_value, other.mean_value);
    });
  }
}

TEST(QuantizedBricks, of_a_field_that_has_let_its_voxels_go_are_the_same) {
  VoxelSources voxels = mixed_voxels(58);
  const auto fresh = make_grid_field(voxels.source(), Affine());
  const BrickPyramid reference = *fresh->quantized_bricks();

  auto owner = std::make_shared<int>();
  const std::weak_ptr<int> watch = owner;
  const VoxelSource source = voxels.source();
  const auto field =
      make_grid_field(VoxelSource({source.leaves().begin(), source.leaves().end()},
                                  {source.tiles().begin(), source.tiles().end()}, std::move(owner)),
                      Affine());
  EXPECT_FALSE(watch.expired());
  field->bricks();
  EXPECT_TRUE(watch.expired()) << "bricks of floats hold all that there is: nobody needs the voxels";
  const BrickPyramid pyramid = *field->quantized_bricks();
  ASSERT_EQ(pyramid.origin(), reference.origin());
  ASSERT_EQ(pyramid.offsets().size(), reference.offsets().size());
  EXPECT_EQ(pyramid.quantized()->scale, reference.quantized()->scale);
  EXPECT_NEAR(pyramid.quantized()->mean_error, reference.quantized()->mean_error, 1e-12);
  for (size_t i = 0; i < pyramid.offsets().size(); ++i) {
    ASSERT_EQ(
        std::memcmp(pyramid.quantized()->stored.get() + pyramid.offsets()[i],
                    reference.quantized()->stored.get() + reference.offsets()[i], 729 * sizeof(int16_t)),
        0);
    ASSERT_EQ(pyramid.levels()[0].ranges[i].lo, reference.levels()[0].ranges[i].lo);
    ASSERT_EQ(pyramid.levels()[0].ranges[i].hi, reference.levels()[0].ranges[i].hi);
  }
}

TEST(VoxelSource, tells_which_bricks_a_leaf_reaches) {
  for_each_simd_target([&](const std::string& target) {
    for (int n = 0; n < 512; ++n) {
      const Vec3i p(n >> 6, n >> 3 & 7, n & 7);
      VoxelSources voxels;
      voxels.set(p, 0.25f);
      const VoxelSource source = voxels.source();
      unsigned expected = 0;
      for (int brick = 0; brick < 8; ++brick) {
        const bool is_corner =
            (!(brick & 1) || p.x == 0) && (!(brick & 2) || p.y == 0) && (!(brick & 4) || p.z == 0);
        if (is_corner) expected |= 1u << brick;
      }
      ASSERT_EQ(unsigned(source.reached(0)), expected) << target << p;
      ASSERT_EQ(source.max_value(), 0.25f);
      ASSERT_EQ(source.bounds().lo(), Vec3i(-1));
      ASSERT_EQ(source.bounds().hi(), Vec3i(8));
    }
  });
}

}  // namespace
}  // namespace pileus
