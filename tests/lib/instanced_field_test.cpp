// One grid in many places against as many grids, each in its own place.
#include "lib/volume/instanced_field.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/volume/grid_field.h"
#include "tests/fixtures/voxel_sources.h"

namespace pileus {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

class InstancedField : public testing::Test {
 protected:
  std::mt19937 m_random{7};
  VoxelSources m_voxels;

  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(m_random); }
  Vec3d vector(double a, double b) { return {uniform(a, b), uniform(a, b), uniform(a, b)}; }

  void SetUp() override {
    m_voxels.add_random_leaf({0, 0, 0}, m_random, 0.3);
    m_voxels.add_random_leaf({8, 0, 8}, m_random, 0.3);
  }

  static Affine turned(const Vec3d& radians) {
    Imath::M44d m;
    m.setEulerAngles(radians);
    return Affine(m);
  }
  Affine random_place(double spread) {
    return Affine::translation(vector(-spread, spread)) * turned(vector(-3, 3)) *
           Affine::scaling(vector(0.3, 1.5));
  }

  /// Rays that pass near the middle.
  Ray random_ray(double spread) {
    const Vec3d o = vector(-2 * spread, 2 * spread), towards = vector(-spread, spread);
    return {o, normalize(towards - o)};
  }
};

TEST_F(InstancedField, is_the_sum_of_grids_in_their_places) {
  const Affine world_from_index = Affine::scaling(Vec3d(0.2));
  const auto grid = make_grid_field(m_voxels.source(), world_from_index);
  for (const double spread : {1.0, 3.0, 30.0}) {  // places overlap often, at times, hardly ever
    std::vector<Affine> places;
    std::vector<std::shared_ptr<const DensityField>> alone;
    for (int n = 0; n < 40; ++n) {
      places.push_back(random_place(spread));
      alone.push_back(make_grid_field(m_voxels.source(), places.back() * world_from_index));
    }
    const auto all = make_instanced_field(grid, places);
    EXPECT_EQ(all->bricks(), grid->bricks()) << "the voxels are held once";
    EXPECT_EQ(all->places().size(), 40u);
    double met = 0.0, most_rho = 0.0;
    for (int n = 0; n < 300; ++n) {
      const Ray ray = random_ray(spread);
      const Segment segment{n % 3 == 0 ? 1.0 : 0.0, n % 2 ? 1.5 * spread : kInf};
      FieldCounters counters;
      double column = 0.0;
      for (const auto& field : alone) column += field->column(ray, segment, kInf, counters);
      EXPECT_NEAR(all->column(ray, segment, kInf, counters), column, 1e-11 * (1.0 + column));
      const double enough = 0.5 * column;
      EXPECT_GE(all->column(ray, segment, enough, counters), enough * (1.0 - 1e-9));

      std::vector<DensityPiece> pieces;
      all->append_pieces(ray, segment, pieces, counters);
      double of_pieces = 0.0;
      for (size_t i = 0; i < pieces.size(); ++i) {
        ASSERT_LT(pieces[i].t0, pieces[i].t1);
        if (i > 0) {
          ASSERT_LE(pieces[i - 1].t1, pieces[i].t0);
        }
        of_pieces += column_to(pieces[i], pieces[i].t1);
      }
      EXPECT_NEAR(of_pieces, column, 1e-11 * (1.0 + column));

      std::array<double, 50> rho, one, sum{};
      const double dt = 0.06 * spread;
      all->sample(ray, 0.1, dt, rho, counters);
      for (const auto& field : alone) {
        field->sample(ray, 0.1, dt, one, counters);
        for (size_t i = 0; i < sum.size(); ++i) sum[i] += one[i];
      }
      for (size_t i = 0; i < sum.size(); ++i) {
        EXPECT_NEAR(rho[i], sum[i], 1e-9);
        if (sum[i] > 0.0) {
          EXPECT_TRUE(all->bounds().intersects(ray.at(0.1 + double(i) * dt)));
          most_rho = std::max(most_rho, sum[i]);
        }
        for (const DensityPiece& piece : pieces) {
          const double t = 0.1 + double(i) * dt;
          if (t >= piece.t0 && t < piece.t1) {
            EXPECT_NEAR(density_at(piece, t), sum[i], 1e-9);
          }
        }
      }
      met += column;
    }
    EXPECT_GT(met, 0.0);
    EXPECT_LE(most_rho, all->max_density());
    if (spread == 30.0) {
      EXPECT_LT(all->max_density(), 4.0 * grid->max_density()) << "few overlap";
    }
  }
}

TEST_F(InstancedField, of_instances_multiplies_places) {
  const auto grid = make_grid_field(m_voxels.source(), Affine());
  const auto row = make_instanced_field(grid, {Affine(), Affine::translation({50, 0, 0})});
  const auto field = make_instanced_field(row, {Affine(), Affine::translation({0, 0, 70})});
  EXPECT_EQ(field->places().size(), 4u);
  FieldCounters counters;
  for (int n = 0; n < 50; ++n) {
    const Ray ray{vector(0, 9) + Vec3d(0, 40, 0), {0, -1, 0}};
    const double once = grid->column(ray, {0.0, kInf}, kInf, counters);
    for (const Vec3d& offset : {Vec3d(50, 0, 0), Vec3d(0, 0, 70), Vec3d(50, 0, 70)}) {
      EXPECT_NEAR(field->column({ray.o + offset, ray.d}, {0.0, kInf}, kInf, counters), once, 1e-12);
    }
  }
}

TEST_F(InstancedField, bounds_its_density_where_places_overlap) {
  const auto grid = make_grid_field(m_voxels.source(), Affine());
  const auto thrice =
      make_instanced_field(grid, {Affine(), Affine(), Affine(), Affine::translation({99, 0, 0})});
  EXPECT_DOUBLE_EQ(thrice->max_density(), 3.0 * grid->max_density());
  EXPECT_DOUBLE_EQ(make_instanced_field(grid, {Affine::scaling(Vec3d(0.5))})->feature_size(), 0.5);
}

/// A ray meets what lies on it, and asks for that alone.
TEST_F(InstancedField, asks_few_of_many) {
  const auto grid = make_grid_field(m_voxels.source(), Affine::scaling(Vec3d(0.1)));
  std::vector<Affine> places;
  for (int x = 0; x < 100; ++x) {
    for (int z = 0; z < 100; ++z) places.push_back(Affine::translation(Vec3d(5.0 * x, 0.0, 5.0 * z)));
  }
  const auto all = make_instanced_field(grid, places);
  FieldCounters counters, alone;
  EXPECT_GT(all->column({{255.3, 9.0, 255.4}, {0, -1, 0}}, {0.0, kInf}, kInf, counters), 0.0);
  grid->column({{0.3, 9.0, 0.4}, {0, -1, 0}}, {0.0, kInf}, kInf, alone);
  EXPECT_EQ(counters.density_samples, alone.density_samples);
}

TEST(AddPieces, cuts_where_lists_overlap) {
  std::vector<DensityPiece> sum{{0, 2, {1, 1, 1, 1}}, {2, 4, {2, 2, 2, 2}}};
  add_pieces(sum, {{1, 3, {4, 4, 4, 4}}, {5, 6, {8, 8, 8, 8}}});
  const double expected[][3] = {{0, 1, 1}, {1, 2, 5}, {2, 3, 6}, {3, 4, 2}, {5, 6, 8}};
  ASSERT_EQ(sum.size(), std::size(expected));
  for (size_t i = 0; i < sum.size(); ++i) {
    EXPECT_EQ(sum[i].t0, expected[i][0]);
    EXPECT_EQ(sum[i].t1, expected[i][1]);
    EXPECT_EQ(sum[i].rho,
              (std::array<double, 4>{expected[i][2], expected[i][2], expected[i][2], expected[i][2]}));
  }
  // A cubic keeps its values where it is cut.
  std::vector<DensityPiece> bent{{0, 1, {0.2, 0.9, 0.1, 0.7}}};
  const DensityPiece whole = bent[0];
  add_pieces(bent, {{0.3, 0.4, {1, 1, 1, 1}}});
  ASSERT_EQ(bent.size(), 3u);
  for (const DensityPiece& piece : bent) {
    for (const double share : {0.01, 0.5, 0.99}) {
      const double t = piece.t0 + share * (piece.t1 - piece.t0), extra = t > 0.3 && t < 0.4 ? 1.0 : 0.0;
      EXPECT_NEAR(density_at(piece, t), density_at(whole, t) + extra, 1e-14);
    }
  }
}

}  // namespace
}  // namespace pileus
