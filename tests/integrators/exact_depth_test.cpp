// Optical depths of the exact integrator against answers known on paper, to 1e-12.
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "integrators/ray_profile.h"
#include "lib/volume/analytic_fields.h"
#include "tests/fixtures/random_grid.h"
#include "tests/reference/single_scattering.h"
#include "vdb_io/openvdb/grid_to_field.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

World world_of(std::vector<std::shared_ptr<const DensityField>> fields, double extinction = 1.0) {
  World world;
  for (auto& field : fields)
    world.media.push_back({"m", std::move(field), extinction, Rgb(1.0), Rgb(0.0), nullptr});
  return world;
}

double tau_along(const World& world, const Ray& ray, Segment segment = {0.0, kInfinity}) {
  RayProfile profile;
  FieldCounters counters;
  profile.build(world, ray, segment, {}, counters);
  return profile.tau();
}

double column_along(const DensityField& field, const Ray& ray, Segment segment = {0.0, kInfinity}) {
  FieldCounters counters;
  return field.column(ray, segment, kInfinity, counters);
}

Vec3d random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return normalize(Vec3d(normal(random), normal(random), normal(random)));
}

TEST(ExactDepth, slab_is_its_chord) {
  const World world = world_of({make_box_field({{-1e6, 0, -1e6}, {1e6, 2, 1e6}})}, 0.7);
  for (const double mu : {1.0, 0.5, 0.1, 1e-3}) {
    const Ray ray{{0, 5, 0}, {std::sqrt(1 - mu * mu), -mu, 0}};
    const double expected = 0.7 * 2 / mu;
    EXPECT_NEAR(tau_along(world, ray), expected, 1e-12 * expected) << mu;
  }
}

TEST(ExactDepth, sphere_is_its_chord) {
  const World world = world_of({make_ellipsoid_field({0, 0, 0}, {2, 2, 2})}, 0.7);
  for (const double offset : {0.0, 0.3, 1.0, 1.9, 1.999}) {
    const double expected = 0.7 * 2 * std::sqrt((2 - offset) * (2 + offset));
    EXPECT_NEAR(tau_along(world, {{offset, 0, 9}, {0, 0, -1}}), expected, 1e-12 * expected) << offset;
  }
  EXPECT_EQ(tau_along(world, {{2.001, 0, 9}, {0, 0, -1}}), 0.0);
}

TEST(ExactDepth, ellipsoid_is_a_stretched_sphere) {
  const World world = world_of({make_ellipsoid_field({1, 2, 3}, {3, 1, 0.5})});
  EXPECT_NEAR(tau_along(world, {{-9, 2, 3}, {1, 0, 0}}), 6.0, 1e-12);
  EXPECT_NEAR(tau_along(world, {{1, -9, 3}, {0, 1, 0}}), 2.0, 1e-12);
  EXPECT_NEAR(tau_along(world, {{1, 2, 30}, {0, 0, -1}}), 1.0, 1e-12);
}

TEST(ExactDepth, exponential_profile) {
  const double scale = 40, top = 400;
  const auto field = make_height_fog_field({{-1e5, 0, -1e5}, {1e5, top, 1e5}}, scale);
  for (const double sine : {1.0, 0.3, 0.01, 1e-5, -0.5}) {
    const double start = sine > 0 ? 0.0 : top;
    const Ray ray{{0, start, 0}, {std::sqrt(1 - sine * sine), sine, 0}};
    const double length = std::min(top / std::abs(sine), 1e5 / ray.d.x);
    const double rise = length * sine;
    const double expected = std::exp(-start / scale) * scale / sine * -std::expm1(-rise / scale);
    EXPECT_NEAR(tau_along(world_of({field}), ray), expected, 1e-12 * expected) << sine;
    EXPECT_NEAR(column_along(*field, ray), expected, 1e-12 * expected) << sine;
  }
  EXPECT_NEAR(column_along(*field, {{0, 10, 0}, {1, 0, 0}}), 1e5 * std::exp(-0.25), 1e-7);
}

TEST(ExactDepth, single_trilinear_cells) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto grid = random_grid(2, seed, 0.0);
    const auto field = field_from_grid(grid, Affine());
    const auto accessor = grid->getConstAccessor();
    const reference::SingleScattering twin(
        [&](int i, int j, int k) {
          return double(accessor.getValue({i, j, k}));
        },
        0, 1);
    std::mt19937 random(seed);
    for (int n = 0; n < 50; ++n) {
      const Vec3d d = random_direction(random);
      const Ray ray{Vec3d(0.5) - 3.0 * d, d};
      const double expected = twin.column(ray, 0, 9);
      EXPECT_NEAR(tau_along(world_of({field}), ray), expected, 1e-12 * expected);
      EXPECT_NEAR(column_along(*field, ray), expected, 1e-12 * expected);
    }
  }
}

TEST(ExactDepth, grids_with_holes_along_random_and_axis_parallel_rays) {
  const auto grid = random_grid(19, 7);
  const auto field = field_from_grid(grid, Affine());
  const auto accessor = grid->getConstAccessor();
  const reference::SingleScattering twin(
      [&](int i, int j, int k) {
        return double(accessor.getValue({i, j, k}));
      },
      0, 18);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-2.0, 20.0);
  for (int n = 0; n < 300; ++n) {
    Vec3d d = random_direction(random);
    if (n % 5 == 0) d = Vec3d(n % 3 == 0, n % 3 == 1, n % 3 == 2) * (n % 2 ? 1.0 : -1.0);
    Vec3d through(uniform(random), uniform(random), uniform(random));
    if (n % 7 == 0) through = Vec3d(std::floor(through.x), std::floor(through.y), std::floor(through.z));
    const Ray ray{through - 50.0 * d, d};
    const double expected = twin.column(ray, 0, 100);
    EXPECT_NEAR(column_along(*field, ray), expected, 1e-12 * std::max(expected, 1.0)) << n;
  }
}

TEST(ExactDepth, huge_tiles_cost_one_piece_and_stay_exact) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(0.0f);
  grid->tree().addTile(1, {0, 0, 0}, 0.5f, true);     // an 8^3 tile
  grid->tree().addTile(2, {128, 0, 0}, 0.25f, true);  // a 128^3 tile
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  const auto field = field_from_grid(grid, Affine());
  // Along x through both: ramps of one voxel at each end keep the full sum of the voxels.
  EXPECT_NEAR(column_along(*field, {{-9, 3, 3}, {1, 0, 0}}), 8 * 0.5 + 128 * 0.25, 1e-12 * 36);
  EXPECT_NEAR(column_along(*field, {{400, 3, 3}, {-1, 0, 0}}), 8 * 0.5 + 128 * 0.25, 1e-12 * 36);
}

TEST(ExactDepth, cells_below_the_lower_face_of_an_otherwise_empty_node_are_found) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(0.0f);
  // Voxel 128 opens a new node; its lower cells lie in the empty node before it.
  for (const openvdb::Coord& voxel :
       {openvdb::Coord(-5, 0, 0), openvdb::Coord(128, 0, 0), openvdb::Coord(4096, 0, 0)}) {
    grid->tree().setValueOn(voxel, 1.0f);
  }
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  const auto field = field_from_grid(grid, Affine());
  EXPECT_NEAR(column_along(*field, {{-20, 0, 0}, {1, 0, 0}}), 3.0, 1e-12);
  EXPECT_NEAR(column_along(*field, {{5000, 0, 0}, {-1, 0, 0}}), 3.0, 1e-12);
}

TEST(ExactDepth, inactive_voxels_count_as_interpolation_sees_them) {
  const auto grid = random_grid(4, 3, 0.0);
  const double all = column_along(*field_from_grid(grid, Affine()), {{-9, 1.5, 1.5}, {1, 0, 0}});
  grid->tree().setValueOff({3, 1, 1}), grid->tree().setValueOff({3, 2, 1});
  grid->tree().setValueOff({3, 1, 2}), grid->tree().setValueOff({3, 2, 2});
  EXPECT_NEAR(column_along(*field_from_grid(grid, Affine()), {{-9, 1.5, 1.5}, {1, 0, 0}}), all, 1e-12);
}

TEST(ExactDepth, transmittances_multiply_over_split_segments) {
  const auto grid = random_grid(12, 5);
  const auto field = field_from_grid(grid, Affine());
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0.0, 40.0);
  for (int n = 0; n < 200; ++n) {
    const Vec3d d = random_direction(random);
    const Ray ray{Vec3d(5.5) - 20.0 * d, d};
    const double b = uniform(random);
    const double whole = column_along(*field, ray, {0, 40});
    const double parts = column_along(*field, ray, {0, b}) + column_along(*field, ray, {b, 40});
    EXPECT_NEAR(parts, whole, 1e-12 * std::max(1.0, whole));
  }
}

TEST(ExactDepth, overlapping_media_add_their_coefficients) {
  const auto box = make_box_field({{-1, -1, -1}, {1, 1, 1}});
  const auto ball = make_ellipsoid_field({0.5, 0, 0}, {1, 1, 1});
  const auto fog = make_height_fog_field({{-2, -2, -2}, {2, 2, 2}}, 1.5);
  std::mt19937 random(2);
  for (int n = 0; n < 100; ++n) {
    const Vec3d d = random_direction(random);
    const Ray ray{0.3 * random_direction(random) - 5.0 * d, d};
    const double expected = column_along(*box, ray) + column_along(*ball, ray) + column_along(*fog, ray);
    EXPECT_NEAR(tau_along(world_of({box, ball, fog}), ray), expected, 1e-12 * expected);
  }
}

TEST(ExactDepth, the_inverse_of_the_optical_depth) {
  const auto field = field_from_grid(random_grid(6, 9), Affine());
  RayProfile profile;
  FieldCounters counters;
  const World world = world_of({field, make_box_field({{0, 0, 0}, {5, 5, 5}})});
  profile.build(world, {{-2, 2.2, 2.7}, normalize(Vec3d(1, 0.1, 0.05))}, {0, kInfinity}, {}, counters);
  ASSERT_GT(profile.spans().size(), 4u);
  for (size_t i = 0; i < profile.spans().size(); ++i) {
    if (profile.spans()[i].tau < 1e-6) continue;  // slivers where the ends of both media almost coincide
    for (const double share : {0.0, 1e-9, 0.3, 0.9999, 1.0}) {
      const double tau = share * profile.spans()[i].tau;
      EXPECT_NEAR(profile.tau_to(i, profile.t_at(i, tau)), tau, 1e-11 * profile.spans()[i].tau);
    }
  }
}

TEST(ExactDepth, hostile_rays_end_and_stay_finite) {
  const auto field = field_from_grid(random_grid(6, 1), Affine());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Ray rays[] = {
      {{0, 0, 0}, {0, 0, 0}},      {{2, 2, 2}, {0, 0, 0}},      {{0, 0, 0}, {1, 0.0, -0.0}},
      {{nan, 0, 0}, {1, 0, 0}},    {{0, 0, 0}, {nan, 0, 1}},    {{kInfinity, 0, 0}, {-1, 0, 0}},
      {{1e300, 2, 2}, {-1, 0, 0}}, {{-1e18, 2, 2}, {1, 0, 0}},  {{0, 0, 0}, {kInfinity, 1, 0}},
      {{1, 1, 1}, {1, 0, 0}},      {{5, 5, 5}, {1, 1e-300, 0}}, {{2, 2, 2}, {1e-320, 0, 1}}};
  for (const Ray& ray : rays) {
    const double column = column_along(*field, ray, {0, 100});
    EXPECT_TRUE(column >= 0.0 && column < 200.0) << column;
  }
}

}  // namespace
}  // namespace pileus
