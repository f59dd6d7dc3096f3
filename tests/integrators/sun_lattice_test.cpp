// Optical depths of lattices against the exact column of the field.
#include "integrators/sun_lattice.h"

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "integrators/kernels/sun_kernel.h"
#include "lib/core/parallel.h"
#include "lib/volume/grid_field.h"
#include "lib/volume/quantized_bricks.h"
#include "tests/fixtures/blob_voxels.h"
#include "tests/fixtures/simd_targets.h"
#include "tests/fixtures/voxel_sources.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

enum class Stored { floats, in_16_bits };

/// A grid as the kernels see it, and the exact answer beside it.
struct LitGrid {
  LitGrid(const VoxelSources& voxels, const Affine& map, double extinction, Stored stored = Stored::floats)
      : field(make_grid_field(voxels.source(), map)),
        pyramid(stored == Stored::floats ? BrickPyramid(*field->bricks())
                                         : build_quantized_bricks(voxels.source())),
        world_from_index(map) {
    const BrickGrid& bricks = *field->bricks();
    const Vec3d origin(pyramid.origin());
    grid.pyramid = &pyramid;
    grid.local_from_world = Affine::translation(-origin) * field->index_from_world();
    grid.bounds = Box3d(Vec3d(bricks.lo()) - origin, Vec3d(bricks.hi()) - origin);
    grid.extinction = extinction;
  }

  double exact(const Vec3d& p, const Vec3d& wi) const {
    FieldCounters counters;
    return grid.extinction * field->column({p, wi}, {0.0, kInfinity}, kInfinity, counters);
  }

  double density(const Vec3d& p) const {
    double rho = 0.0;
    FieldCounters counters;
    field->sample({p, {1, 0, 0}}, 0.0, 1.0, {&rho, 1}, counters);
    return rho;
  }

  /// A point of the box of cells, in world space; 0 .. 1 along each axis.
  Vec3d at(const Vec3d& share) const {
    const Vec3d lo(field->bricks()->lo()), hi(field->bricks()->hi());
    return world_from_index.point(lo + share * (hi - lo));
  }

  std::shared_ptr<const DensityField> field;
  BrickPyramid pyramid;
  Affine world_from_index;
  MarchGrid grid;
};

VoxelSources blob(const Vec3d& center, const Vec3d& radii) {
  VoxelSources voxels;
  for_each_voxel_of_blob(center, radii, [&](const Vec3i& p, float rho) { voxels.set(p, rho); });
  return voxels;
}

Affine turned(const Vec3d& axis, double angle, const Vec3d& scale, const Vec3d& offset) {
  Imath::M44d rotation;
  rotation.setAxisAngle(normalize(axis), angle);
  return Affine::translation(offset) * Affine(rotation) * Affine::scaling(scale);
}

std::vector<Vec3d> directions() {
  std::vector<Vec3d> all;
  for (int n = 0; n < 27; ++n) {
    if (n == 13) continue;
    all.push_back(normalize(Vec3d(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)));
  }
  all.push_back(normalize(Vec3d(0.3, 0.8, 0.5)));
  all.push_back(normalize(Vec3d(1e-9, 1, -1e-12)));
  all.push_back(normalize(Vec3d(0.99, 1, -0.98)));
  all.push_back(normalize(Vec3d(0.2, -0.1, -0.7)));
  return all;
}

LatticeOptions spaced(double across, double along = 0.0) {
  LatticeOptions options;
  options.spacing = {across, along > 0.0 ? along : across};
  return options;
}

/// Root mean square of the error over random points of the grid's box.
double rms_error(const LitGrid& lit, const Vec3d& wi, const LatticeOptions& options,
                 double* largest = nullptr) {
  const SunLattice lattice = build_sun_lattice(lit.grid, wi, options);
  std::mt19937 random(41);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  double sum = 0.0;
  constexpr int kPoints = 3000;
  for (int n = 0; n < kPoints; ++n) {
    const Vec3d p = lit.at({uniform(random), uniform(random), uniform(random)});
    const double error = sun_depth(lattice, p) - lit.exact(p, wi);
    if (largest) *largest = std::max(*largest, std::abs(error));
    sum += error * error;
  }
  return std::sqrt(sum / kPoints);
}

/// Largest exact depth over points of the box.
double deepest(const LitGrid& lit, const Vec3d& wi) {
  double depth = 0.0;
  for (int n = 0; n < 1000; ++n)
    depth = std::max(depth, lit.exact(lit.at(Vec3d(n % 10, n / 10 % 10, n / 100) / 9.0), wi));
  return depth;
}

TEST(SunLattice, second_order_on_a_smooth_blob) {
  const LitGrid lit(blob({3, 40, -20}, {40, 34, 37}), Affine(), 0.1);
  for (const Vec3d& wi : directions()) {
    const double scale = deepest(lit, wi);
    const double at_8 = rms_error(lit, wi, spaced(8)), at_4 = rms_error(lit, wi, spaced(4)),
                 at_2 = rms_error(lit, wi, spaced(2));
    EXPECT_LT(at_8, 0.03 * scale) << wi;
    EXPECT_GT(at_8 / at_4, 2.8) << wi << ": " << at_8 << ", " << at_4 << ", " << at_2;
    EXPECT_GT(at_4 / at_2, 2.5) << wi << ": " << at_8 << ", " << at_4 << ", " << at_2;
    EXPECT_LT(at_2, 0.002 * scale) << wi;
  }
}

/// From three voxels on, lattices of 16-bit grids are made of means. What these blur is undone: such lattices
/// err little more than those of values do.
TEST(SunLattice, means_will_do_where_nodes_are_far_apart) {
  const VoxelSources voxels = blob({3, 40, -20}, {40, 34, 37});
  const LitGrid values(voxels, Affine(), 0.1), means(voxels, Affine(), 0.1, Stored::in_16_bits);
  for_each_simd_target([&](const std::string& target) {
    for (const Vec3d& wi : {Vec3d(0, 0, 1), Vec3d(0, 1, 0), Vec3d(-1, 0, 0), normalize(Vec3d(1, -1, 1)),
                            normalize(Vec3d(0.3, 0.8, 0.5)), normalize(Vec3d(0.2, -0.1, -0.7))}) {
      const double scale = deepest(values, wi);
      double at_6 = 0.0;
      for (const double spacing : {6.0, 4.0, 3.0}) {
        SCOPED_TRACE(testing::Message() << target << ' ' << wi << ' ' << spacing);
        const double error = rms_error(means, wi, spaced(spacing));
        EXPECT_LT(error, 1.5 * rms_error(values, wi, spaced(spacing)) + 2e-5 * scale);
        if (spacing == 6.0) at_6 = error;
        if (spacing == 3.0) {
          EXPECT_LT(error, at_6 / 2.5);
        }
      }
    }
  });
}

/// By how much the depths of a lattice are too large on the whole, relative to them.
double bias(const LitGrid& lit, const Vec3d& wi, const LatticeOptions& options) {
  constexpr int kSide = 20;
  const SunLattice lattice = build_sun_lattice(lit.grid, wi, options);
  double errors = 0.0, depths = 0.0;
  for (int n = 0; n < kSide * kSide * kSide; ++n) {
    const Vec3d share(n / (kSide * kSide), n / kSide % kSide, n % kSide);
    const Vec3d p = lit.at((share + Vec3d(0.5)) / kSide);
    const double exact = lit.exact(p, wi);
    errors += sun_depth(lattice, p) - exact;
    depths += exact;
  }
  return errors / depths;
}

/// What lies between lines is in means, but not in values that happen to lie on lines.
TEST(SunLattice, means_keep_the_depth_of_details_between_lines) {
  std::mt19937 random(47);
  VoxelSources voxels;
  for (int n = 0; n < 64; ++n) voxels.add_random_leaf(Vec3i(n / 16, n / 4 % 4, n % 4) * 8, random, 0.5);
  const LitGrid values(voxels, Affine(), 0.1), means(voxels, Affine(), 0.1, Stored::in_16_bits);
  double of_means = 0.0, of_values = 0.0;
  for (const Vec3d& wi : directions()) {
    for (const double spacing : {6.0, 4.0, 3.0}) {
      EXPECT_LT(rms_error(means, wi, spaced(spacing)), 1.3 * rms_error(values, wi, spaced(spacing))) << wi;
      of_means += std::pow(bias(means, wi, spaced(spacing)), 2);
      of_values += std::pow(bias(values, wi, spaced(spacing)), 2);
    }
  }
  EXPECT_LT(of_means, 0.25 * of_values);
}

/// A probe says what the lattice would, which is built for comparison; only the rounding of nodes is not in
/// it.
void expect_probes_like_lattices(const LitGrid& lit, LatticeOptions options, const std::string& what) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> uniform(-0.2, 1.2);
  for (const Vec3d& wi : directions()) {
    const SunLattice lattice = build_sun_lattice(lit.grid, wi, options);
    const SunProbe probe(lit.grid, wi, options);
    for (int n = 0; n < 40; ++n) {
      const Vec3d p = lit.at({uniform(random), uniform(random), uniform(random)});
      const double depth = sun_depth(lattice, p), rounding = 0x1p-13 * (depth + 0.125);
      ASSERT_NEAR(probe.depth(p), depth, 1.1 * rounding + 2e-5)
          << what << ", wi " << wi << ", p " << p << ", spacing " << options.spacing.across;
    }
  }
}

TEST(SunLattice, probes_say_what_lattices_would) {
  VoxelSources noise;
  std::mt19937 random(29);
  for (int n = 0; n < 18; ++n) noise.add_random_leaf(Vec3i(n / 6, n / 2 % 3, n % 2 + 1) * 8, random, 0.4);
  noise.add_tile({24, 8, 8}, 8, 0.7f);
  const Affine map = turned({1, 2, -3}, 0.7, {0.5, 0.8, 0.4}, {3, -2, 1});
  const LitGrid floats(noise, map, 0.6), in_16_bits(noise, map, 0.6, Stored::in_16_bits);
  for_each_simd_target([&](const std::string& target) {
    for (const double across : {0.37, 1.0, 2.9}) {
      LatticeOptions options = spaced(across, 1.5 * across);
      expect_probes_like_lattices(floats, options, target + ", floats");
      expect_probes_like_lattices(in_16_bits, options, target + ", 16 bits");
      options.enough = 3.0f;
      expect_probes_like_lattices(in_16_bits, options, target + ", as far as depths of 3");
    }
  });
}

TEST(SunLattice, affine_grids) {
  const VoxelSources voxels = blob({0, 0, 0}, {30, 26, 34});
  const Affine maps[] = {
      Affine::scaling({0.01, 0.01, 0.01}),
      turned({1, 2, 3}, 1.1, {0.5, 0.5, 0.5}, {3, -7, 11}),
      turned({3, -1, 2}, 2.5, {0.2, 1.5, 0.7}, {-100, 40, 3}),
      turned({0, 1, 0}, 0.3, {-0.5, 0.5, 0.25}, {0, 0, 0}),                        // mirrored
      Affine(Imath::M44d(1, 0.4, 0, 0, 0, 1, 0.3, 0, -0.2, 0, 1, 0, 5, 6, 7, 1)),  // sheared
      turned({1, 2, 3}, 1.1, {0.5, 0.5, 0.5}, {1e5, -1e5, 1e5}),
  };
  for (const Affine& map : maps) {
    const double voxel = std::cbrt(std::abs(map.determinant()));
    const LitGrid lit(voxels, map, 0.1 / voxel);
    for (const Vec3d& wi : directions()) {
      const double scale = deepest(lit, wi), at_4 = rms_error(lit, wi, spaced(4)),
                   at_2 = rms_error(lit, wi, spaced(2));
      EXPECT_LT(at_4, 0.01 * scale) << wi << map.matrix();
      EXPECT_GT(at_4 / at_2, 2.3) << wi << map.matrix();
    }
  }
}

TEST(SunLattice, random_voxels_get_closer_with_finer_spacing) {
  std::mt19937 random(43);
  VoxelSources voxels;
  for (int n = 0; n < 27; ++n) voxels.add_random_leaf(Vec3i(n % 3, n / 3 % 3, n / 9) * 8, random, 0.5);
  voxels.add_tile({24, 8, 8}, 8, 0.9f);
  const LitGrid lit(voxels, Affine(), 0.2);
  for (const Vec3d& wi : directions()) {
    const double scale = deepest(lit, wi);
    double largest = 0.0;
    const double at_4 = rms_error(lit, wi, spaced(4)), at_1 = rms_error(lit, wi, spaced(1)),
                 finest = rms_error(lit, wi, spaced(0.5), &largest);
    EXPECT_LT(finest, 0.02 * scale) << wi;
    EXPECT_LT(largest, 0.15 * scale) << wi;
    EXPECT_LT(at_1, 0.5 * at_4) << wi;
    EXPECT_LT(finest, at_1) << wi;
  }
}

TEST(SunLattice, points_outside) {
  const LitGrid lit(blob({3, 40, -20}, {40, 34, 37}), turned({1, 2, 0}, 0.4, {0.5, 0.5, 0.4}, {10, 20, 30}),
                    0.2);
  std::mt19937 random(44);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (const Vec3d& wi : directions()) {
    const double scale = deepest(lit, wi);
    const SunLattice lattice = build_sun_lattice(lit.grid, wi, spaced(3));
    int shaded = 0;
    for (int n = 0; n < 500; ++n) {
      const Vec3d inside = lit.at({uniform(random), uniform(random), uniform(random)});
      for (const double away : {40.0, 80.0, 1e3, 1e5}) {
        const Vec3d dark = inside - away * wi, bright = inside + away * wi;
        const double expected = lit.exact(dark, wi);
        ASSERT_NEAR(sun_depth(lattice, dark), expected, 0.02 * scale + 1e-9 * away) << wi << ", " << away;
        shaded += expected > 0.1 * scale;
        ASSERT_NEAR(sun_depth(lattice, bright), lit.exact(bright, wi), 0.02 * scale) << wi << ", " << away;
        // Beside: moved across the light, as far as no line from there meets the box.
        const Vec3d across = normalize(cross(wi, std::abs(wi.x) < 0.5 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0)));
        ASSERT_NEAR(sun_depth(lattice, inside + (away + 100.0) * across), 0.0, 1e-3 * scale)
            << wi << ", " << away;
      }
    }
    EXPECT_GT(shaded, 100) << wi;
  }
}

TEST(SunLattice, an_empty_grid_casts_no_shadow) {
  const LitGrid lit(VoxelSources(), Affine(), 5.0);
  for (const Vec3d& wi : directions()) {
    const SunLattice lattice = build_sun_lattice(lit.grid, wi, spaced(2));
    for (int axis = 0; axis < 3; ++axis) ASSERT_GE(lattice.bricks[axis], 1) << wi;
    for (const Vec3d& p : {Vec3d(0), Vec3d(10, -3, 7), Vec3d(-1e5, 1, 1)})
      EXPECT_EQ(sun_depth(lattice, p), 0.0);
  }
}

TEST(SunLattice, one_voxel) {
  VoxelSources voxels;
  voxels.set({5, 5, 5}, 1.0f);
  const LitGrid lit(voxels, Affine(), 2.0);
  for (const Vec3d& wi : directions()) {
    const SunLattice lattice = build_sun_lattice(lit.grid, wi, spaced(0.5));
    EXPECT_NEAR(sun_depth(lattice, Vec3d(5.0)), lit.exact(Vec3d(5.0), wi), 0.35) << wi;
    EXPECT_NEAR(sun_depth(lattice, Vec3d(5.0) - 3.0 * wi), lit.exact(Vec3d(5.0) - 3.0 * wi, wi), 0.5) << wi;
    EXPECT_NEAR(sun_depth(lattice, Vec3d(5.0) + 3.0 * wi), 0.0, 0.05) << wi;
  }
}

/// Points all over a lattice, cells and borders of bricks alike.
std::vector<Vec3d> points_of(const SunLattice& lattice, int count) {
  const Affine world_from_lattice = lattice.lattice_from_world.inverse();
  std::mt19937 random(45);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Vec3d> points;
  for (int n = 0; n < count; ++n) {
    Vec3d p(uniform(random), uniform(random), uniform(random));
    p *= double(SunLattice::kBrickCells) * Vec3d(lattice.bricks);
    if (n % 2 == 0) p[n % 3] = std::round(p[n % 3]);
    points.push_back(world_from_lattice.point(p));
  }
  return points;
}

TEST(SunLattice, no_depth_is_far_below_zero_however_dense_the_grid) {
  // Negative depths brighten: a floor keeps responses close to what a medium can scatter.
  VoxelSources voxels = blob({0, 0, 0}, {20, 20, 20});
  voxels.add_tile({32, 0, 0}, 8, 1.0f);
  for (const double extinction : {1e-8, 1.0, 1e4, 1e12}) {
    const LitGrid lit(voxels, Affine(), extinction);
    for (const Vec3d& wi : directions()) {
      const SunLattice lattice = build_sun_lattice(lit.grid, wi, spaced(4));
      for (const Vec3d& p : points_of(lattice, 2000)) {
        ASSERT_GE(sun_depth(lattice, p), -0.1001) << wi << ", extinction " << extinction;
        ASSERT_LE(sun_depth(lattice, p), 1001.0) << wi << ", extinction " << extinction;
      }
    }
  }
}

TEST(SunLattice, along_the_light_nodes_may_stand_further_apart) {
  const LitGrid lit(blob({3, 40, -20}, {40, 34, 37}), Affine(), 0.1);
  for (const Vec3d& wi : directions()) {
    const auto bytes = [&](double along) {
      return double(build_sun_lattice(lit.grid, wi, spaced(2, along)).memory_bytes());
    };
    EXPECT_LT(bytes(4), 0.75 * bytes(2)) << wi;
    EXPECT_LT(rms_error(lit, wi, spaced(2, 4)), 0.003 * deepest(lit, wi)) << wi;
  }
}

TEST(SunLattice, sparse_ones_are_the_same_where_there_is_a_density) {
  std::mt19937 random(46);
  VoxelSources scattered;
  for (int n = 0; n < 6; ++n) scattered.add_random_leaf(Vec3i(n * 5 % 7, n * 3 % 5, n) * 16, random, 0.2);
  const Affine map = turned({1, 2, 0}, 0.4, {0.5, 0.5, 0.4}, {10, 20, 30});
  for (const VoxelSources& voxels : {scattered, blob({3, 40, -20}, {30, 24, 27})}) {
    const LitGrid lit(voxels, map, 0.3);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (const Vec3d& wi : directions()) {
      for (const double spacing : {0.7, 2.0, 5.0}) {
        LatticeOptions options = spaced(spacing, 1.7 * spacing);
        const SunLattice whole = build_sun_lattice(lit.grid, wi, options);
        options.is_everywhere = false;
        const SunLattice sparse = build_sun_lattice(lit.grid, wi, options);
        ASSERT_LE(sparse.used, whole.used) << wi;
        for (int n = 0; n < 1000; ++n) {
          const Vec3d p = lit.at({uniform(random), uniform(random), uniform(random)});
          if (lit.density(p) == 0.0) continue;
          ASSERT_EQ(sun_depth(sparse, p), sun_depth(whole, p)) << wi << ", spacing " << spacing;
        }
      }
    }
  }
}

TEST(SunLattice, depths_that_are_enough_need_no_nodes) {
  const LitGrid lit(blob({0, 0, 0}, {40, 40, 40}), Affine(), 1.0);
  const Vec3d wi = normalize(Vec3d(0.3, 0.8, 0.5));
  LatticeOptions options = spaced(1);
  const SunLattice whole = build_sun_lattice(lit.grid, wi, options);
  options.enough = 6.0f;
  const SunLattice cut = build_sun_lattice(lit.grid, wi, options);
  EXPECT_LT(double(cut.used), 0.9 * double(whole.used));
  for (const Vec3d& p : points_of(whole, 20000)) {
    const double depth = sun_depth(whole, p), got = sun_depth(cut, p);
    if (depth < 4.0) {
      ASSERT_NEAR(got, depth, 2e-3);
    } else {
      // Balancing blunts the edge of what is cut off.
      ASSERT_GE(got, std::min(depth, 6.0) - 0.5);
      ASSERT_LE(got, 6.001);
    }
  }
}

TEST(SunLattice, one_that_does_not_fit_has_no_bricks) {
  const LitGrid lit(blob({0, 0, 0}, {40, 40, 40}), Affine(), 1.0);
  LatticeOptions options = spaced(1);
  const SunLattice whole = build_sun_lattice(lit.grid, {0, 1, 0}, options);
  EXPECT_GT(whole.bricks.x, 0);
  for (const double share : {0.0, 0.01, 0.5, 0.95}) {
    options.most_bytes = share * double(whole.memory_bytes());
    EXPECT_EQ(build_sun_lattice(lit.grid, {0, 1, 0}, options).bricks.x, 0) << share;
  }
  options.most_bytes = 1e18;
  options.spacing = {1e-4, 1e-4};
  EXPECT_GT(sun_lattice_bytes(lit.grid, {0, 1, 0}, options), 1e14);
}

TEST(SunLattice, same_bits_for_any_number_of_threads_and_all_instruction_sets_agree) {
  const LitGrid lit(blob({3, 4, 5}, {20, 18, 16}), Affine(), 0.3);
  const Vec3d wi = normalize(Vec3d(0.3, 0.8, 0.5));
  const LatticeOptions options = spaced(0.7, 1.5);
  const SunLattice reference = build_sun_lattice(lit.grid, wi, options);
  const std::vector<Vec3d> points = points_of(reference, 5000);
  for (const int threads : {1, 2, 5}) {
    with_threads(threads, [&] {
      const SunLattice lattice = build_sun_lattice(lit.grid, wi, options);
      ASSERT_EQ(lattice.used, reference.used);
      for (const Vec3d& p : points) ASSERT_EQ(sun_depth(lattice, p), sun_depth(reference, p)) << threads;
    });
  }
  for_each_simd_target([&](const std::string& target) {
    const SunLattice lattice = build_sun_lattice(lit.grid, wi, options);
    for (const Vec3d& p : points) {
      const double depth = sun_depth(reference, p);
      ASSERT_NEAR(sun_depth(lattice, p), depth, 1e-5 + 2e-4 * (depth + 0.125)) << target;
    }
  });
}

TEST(SunLattice, columns_by_steps_come_close_to_the_exact_ones) {
  std::mt19937 random(47);
  VoxelSources scattered;
  for (int n = 0; n < 27; ++n) scattered.add_random_leaf(Vec3i(n % 3, n / 3 % 3, n / 9) * 8, random, 0.5);
  std::uniform_real_distribution<double> uniform(-0.2, 1.2);
  const LitGrid lit(scattered, turned({1, 2, 0}, 0.4, {0.5, 0.5, 0.4}, {10, 20, 30}), 0.3);
  for (const Vec3d& wi : directions()) {
    double sum[2] = {0.0, 0.0};
    for (int n = 0; n < 300; ++n) {
      const Vec3d p = lit.at({uniform(random), uniform(random), uniform(random)});
      const Ray local{lit.grid.local_from_world.point(p), lit.grid.local_from_world.direction(wi)};
      for (int k = 0; k < 2; ++k) {
        const double dt = (k == 0 ? 0.5 : 0.125) / length(local.d);
        const double error = lit.grid.extinction * stepped_column(lit.grid, local, dt) - lit.exact(p, wi);
        sum[k] += error * error;
      }
    }
    const double scale = deepest(lit, wi);
    EXPECT_LT(std::sqrt(sum[0] / 300), 0.01 * scale) << wi;
    EXPECT_LT(std::sqrt(sum[1] / 300), 0.001 * scale) << wi;
  }
}

TEST(SunLattice, densities_at_equal_steps) {
  const LitGrid lit(blob({3, 40, -20}, {30, 24, 27}), turned({1, 2, 0}, 0.4, {0.5, 0.5, 0.4}, {10, 20, 30}),
                    0.3);
  std::mt19937 random(48);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int n = 0; n < 100; ++n) {
    const Vec3d a = lit.at({uniform(random), uniform(random), uniform(random)}),
                b = lit.at({uniform(random), uniform(random), uniform(random)});
    const Ray ray{a - 0.5 * (b - a), normalize(b - a)};
    const double dt = 0.3;
    std::vector<float> rho(200, -1.0f);
    sample_density(lit.grid,
                   {lit.grid.local_from_world.point(ray.o), lit.grid.local_from_world.direction(ray.d)}, 0.1,
                   dt, rho);
    for (size_t i = 0; i < rho.size(); ++i)
      ASSERT_NEAR(rho[i], lit.density(ray.at(0.1 + double(i) * dt)), 1e-3) << n << ", " << i;
  }
}

}  // namespace
}  // namespace pileus
