// Lights at a finite distance in the march: what its lattices and tables say, and pictures against the exact
// integrator.
#include <cmath>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "integrators/lamp_lattice.h"
#include "integrators/phase_table.h"
#include "lib/core/parallel.h"
#include "lib/math/henyey_greenstein.h"
#include "lib/volume/grid_field.h"
#include "tests/fixtures/blob_voxels.h"
#include "tests/fixtures/hunt.h"
#include "tests/fixtures/march_scenes.h"
#include "tests/fixtures/picture_scene.h"
#include "tests/fixtures/simd_targets.h"
#include "tests/fixtures/voxel_sources.h"
#include "tests/shaders_cpu/make_plugin.h"

namespace pileus {
namespace {

/// A blob as the kernels see it, turned and stretched, and the exact answer beside it.
struct LitBlob {
  LitBlob() {
    VoxelSources voxels;
    for_each_voxel_of_blob({3, 40, -20}, {26, 20, 23},
                           [&](const Vec3i& p, float rho) { voxels.set(p, rho); });
    Imath::M44d turn;
    turn.setAxisAngle(normalize(Vec3d(1, 2, -1)), 0.7);
    world_from_index = Affine::translation({5, -2, 1}) * Affine(turn) * Affine::scaling({0.1, 0.2, 0.15});
    field = make_grid_field(voxels.source(), world_from_index);
    pyramid = std::make_unique<BrickPyramid>(*field->bricks());
    const Vec3d origin(pyramid->origin());
    grid.pyramid = pyramid.get();
    grid.local_from_world = Affine::translation(-origin) * field->index_from_world();
    grid.bounds = Box3d(Vec3d(pyramid->lo()) - origin, Vec3d(pyramid->hi()) - origin);
    grid.extinction = 0.8;
  }

  /// A point by its share of the box of cells.
  Vec3d at(const Vec3d& share) const {
    const Vec3d lo(field->bricks()->lo()), hi(field->bricks()->hi());
    return world_from_index.point(lo + share * (hi - lo));
  }

  double exact(const Vec3d& p, const Vec3d& lamp) const {
    FieldCounters counters;
    const double distance = length(lamp - p);
    return grid.extinction * field->column({p, (lamp - p) / distance}, {0.0, distance}, 1e30, counters);
  }

  Affine world_from_index;
  std::shared_ptr<const DensityField> field;
  std::unique_ptr<BrickPyramid> pyramid;
  MarchGrid grid;
};

const LitBlob& lit() {
  static const LitBlob blob;
  return blob;
}

/// Where lamps stand: shares of the blob's box.
std::vector<Vec3d> lamp_places() {
  return {{0.5, 0.5, 0.5},  {0.31, 0.62, 0.44}, {0.02, 0.5, 0.97},  {1.05, 0.5, 0.5},
          {1.3, 1.2, -0.4}, {0.5, 4.0, 0.5},    {-3.0, 0.2, 0.7},   {30, 40, -20},
          {0.5, 0.5, -2e4}, {0.0, 0.0, 0.0},    {1.0, 0.5, 1.0 / 3}};
}

struct Deviation {
  double mean, worst;
};

/// Of the depths at random points, in the box and around it.
Deviation deviation(const Vec3d& lamp, double spacing) {
  LatticeOptions options;
  options.spacing = {spacing, spacing};
  bool fits = true;
  const std::vector<LampFace> faces = build_lamp_faces(lit().grid, lamp, options, fits);
  EXPECT_TRUE(fits);
  std::mt19937 random(41);
  std::uniform_real_distribution<double> uniform(-0.5, 1.5);
  Deviation found{0.0, 0.0};
  constexpr int kPoints = 3000;
  for (int n = 0; n < kPoints; ++n) {
    const Vec3d p = lit().at({uniform(random), uniform(random), uniform(random)});
    const double error = std::abs(lamp_depth(faces, p) - lit().exact(p, lamp));
    found.mean += error / kPoints;
    found.worst = std::max(found.worst, error);
  }
  return found;
}

TEST(LampLattice, second_order_wherever_the_lamp_stands) {
  for (const Vec3d& share : lamp_places()) {
    SCOPED_TRACE(testing::Message() << share);
    const Vec3d lamp = lit().at(share);
    const Deviation coarsest = deviation(lamp, 8.0), coarse = deviation(lamp, 4.0),
                    fine = deviation(lamp, 1.0);
    EXPECT_LT(coarse.worst, 0.3);
    EXPECT_LT(coarse.mean, 0.01);
    EXPECT_LT(fine.worst, 0.03);
    EXPECT_LT(fine.mean, 0.0008);
    // Near lamps ask for more than these spacings do.
    const bool is_far = length(share - Vec3d(0.5)) > 2.5;
    EXPECT_GT(1.01 * coarsest.mean, (is_far ? 2.8 : 1.0) * coarse.mean);
  }
}

TEST(LampLattice, instruction_sets_agree) {
  for (const Vec3d& share : lamp_places()) {
    const Vec3d lamp = lit().at(share);
    std::vector<double> first;
    for_each_simd_target([&](const std::string& target) {
      LatticeOptions options;
      options.spacing = {2.0, 3.0};
      bool fits = true;
      const std::vector<LampFace> faces = build_lamp_faces(lit().grid, lamp, options, fits);
      std::vector<double> depths;
      for (int n = 0; n < 343; ++n)
        depths.push_back(lamp_depth(faces, lit().at(Vec3d(n % 7, n / 7 % 7, n / 49) / 6.1)));
      if (first.empty()) first = depths;
      for (size_t i = 0; i < depths.size(); ++i)
        ASSERT_NEAR(depths[i], first[i], 2e-3 * (first[i] + 0.125)) << target << ' ' << share << ' ' << i;
    });
  }
}

TEST(LampLattice, complains_where_memory_does_not_suffice) {
  LatticeOptions options;
  options.spacing = {0.5, 0.5};
  options.most_bytes = 1e5;
  for (const Vec3d& share : lamp_places()) {
    bool fits = true;
    build_lamp_faces(lit().grid, lit().at(share), options, fits);
    EXPECT_FALSE(fits) << share;
  }
}

TEST(LampLattice, leaves_out_what_nobody_reads) {
  for (const Vec3d& share : lamp_places()) {
    const Vec3d lamp = lit().at(share);
    LatticeOptions options;
    options.spacing = {1.0, 1.5};
    bool fits = true;
    const std::vector<LampFace> all = build_lamp_faces(lit().grid, lamp, options, fits);
    options.is_everywhere = false;
    const std::vector<LampFace> some = build_lamp_faces(lit().grid, lamp, options, fits);
    ASSERT_EQ(all.size(), some.size());
    int64_t used_by_all = 0, used_by_some = 0;
    for (size_t n = 0; n < all.size(); ++n)
      used_by_all += all[n].depths.used, used_by_some += some[n].depths.used;
    EXPECT_LT(used_by_some, used_by_all) << share;
    std::mt19937 random(42);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (int n = 0; n < 2000; ++n) {
      const Vec3d p = lit().at({uniform(random), uniform(random), uniform(random)});
      double rho = 0.0;
      FieldCounters counters;
      lit().field->sample({p, {1, 0, 0}}, 0.0, 1.0, {&rho, 1}, counters);
      if (rho > 0.0) {
        ASSERT_EQ(lamp_depth(all, p), lamp_depth(some, p)) << share;
      }
    }
  }
}

/// A scattering angle as directions that leave a point: viewer, light.
std::pair<Vec3d, Vec3d> directions_at(double angle) {
  return {Vec3d(0, 0, 1), Vec3d(std::sin(angle), 0, -std::cos(angle))};
}

TEST(PhaseTable, errs_as_little_as_told) {
  for (const double g : {0.0, 0.3, 0.7, -0.85, 0.95, 0.99, -0.999, 0.9999}) {
    const auto phase = make_plugin<PhaseFunction>("hg", {{"g", g}});
    const PhaseTable table = phase_table(*phase);
    if (std::abs(g) <= 0.99) {
      EXPECT_LE(table.error, 5e-5) << g;
    }
    for (int n = 0; n <= 100000; ++n) {
      const auto [wo, wi] = directions_at(std::numbers::pi * n / 100000);
      const double p = phase->p(wo, wi), s = phase_coordinate(wo, wi);
      ASSERT_NEAR(phase_at(table, s), p, (1.5 * table.error + 1e-6) * std::max(p, 1e-5)) << g << ' ' << n;
      ASSERT_LE(p, 1.0001 * table.between(s, s).most + 1e-9) << g << ' ' << n;
    }
  }
}

TEST(PhaseTable, its_coordinate_grows_with_the_angle) {
  double before = -1e-9;
  for (int n = 0; n <= 2000; ++n) {
    const auto [wo, wi] = directions_at(std::numbers::pi * n / 2000);
    const double s = phase_coordinate(wo, wi);
    EXPECT_GT(s, before);
    EXPECT_LT(s - before, 0.001);
    before = s;
  }
  EXPECT_NEAR(before, PhaseTable::kWhole, 1e-12);
}

double largest(const Rgb& d) {
  return std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
}

/// Lamps wherever they may stand, in grids of all kinds.
class LampHunt {
 public:
  explicit LampHunt(unsigned seed) : m_random(seed) {}

  std::string text() {
    std::string text = MarchScenes::camera(chance(0.2) ? "[0.3, 0.2, 0.4]" : "[0, 1, 8]");
    const int grids = chance(0.3) ? 2 : 1, lamps = chance(0.3) ? 2 : 1;
    for (int n = 0; n < grids; ++n) {
      text += m_scenes.grid(chance(0.5)   ? "blob"
                            : chance(0.5) ? "random"
                                          : "thin",
                            medium(), fmt::format("grid{}", n));
    }
    for (int n = 0; n < lamps; ++n) {
      // Bright enough to be seen from where the medium is, mostly.
      const double away = logarithmic(0.05, 20.0),
                   intensity = logarithmic(0.3, 30.0) * std::max(0.3, away * away);
      text += MarchScenes::lamp(
          fmt::format("lamp{}", n), fmt::format("[{}, {}, {}]", away * sign(), away * sign(), away * sign()),
          fmt::format("[{}, {}, {}]", intensity, intensity * uniform(), intensity * uniform()),
          logarithmic(1e-4, 0.5));
    }
    if (chance(0.3)) text += MarchScenes::sun();
    return text;
  }

  bool chance(double p) { return uniform() < p; }

 private:
  double uniform() { return std::uniform_real_distribution<double>()(m_random); }
  double sign() { return 2.0 * uniform() - 1.0; }
  double logarithmic(double a, double b) { return a * std::pow(b / a, uniform()); }

  std::string medium() {
    std::string text =
        fmt::format("extinction = {}\nalbedo = [{}, {}, 1]\n", logarithmic(0.1, 20.0), uniform(), uniform());
    if (chance(0.5)) text += fmt::format("phase = {{ type = \"hg\", g = {} }}\n", 0.95 * sign());
    if (chance(0.3)) text += "multiple_scattering = { octaves = 4 }\n";
    if (chance(0.3)) text += fmt::format("powder = {{ strength = {} }}\n", uniform());
    if (chance(0.3)) text += "emission = [0.3, 0.2, 0.1]\n";
    if (chance(0.5)) text += fmt::format("translate = [{}, {}, {}]\n", sign(), sign(), sign());
    if (chance(0.3)) text += "rotate_deg = [20, 40, 60]\nscale = [0.5, 1, 0.7]\n";
    return text;
  }

  static const MarchScenes& scenes() {
    static const MarchScenes all;
    return all;
  }

  const MarchScenes& m_scenes = scenes();
  std::mt19937 m_random;
};

/// A rule with far nodes may miss the peak that a ray has beside a lamp behind dense matter.
TEST(ExactLamps, the_light_close_to_them_is_found) {
  constexpr double kTolerance = 0.002;
  const MarchScenes scenes;
  for (int n = 0; n < 8; ++n) {
    const std::string text =
        MarchScenes::camera("[0.3, 0.2, 0.4]") +
        scenes.grid("blob",
                    "extinction = 13\nmultiple_scattering = { octaves = 4 }\npowder = { strength = 0.7 }") +
        MarchScenes::lamp("lamp", fmt::format("[{}, -0.012, 0.103]", -0.18 - 0.004 * n), "[0.3, 0.2, 0.1]",
                          0.003);
    const std::vector<RayResult> got = PictureScene("\"exact\"", text, kTolerance, {16, 12}).picture(64),
                                 expected = PictureScene("\"exact\"", text, 1e-6, {16, 12}).picture(64);
    for (size_t i = 0; i < got.size(); ++i)
      EXPECT_LE(largest(got[i].radiance - expected[i].radiance), kTolerance) << n << ", ray " << i;
  }
}

TEST(MarchedLamps, random_scenes_stay_within_the_tolerance) {
  const int scenes = hunted(60);
  size_t rays = 0, beyond = 0, handed_over = 0;
  for (int seed = 0; seed < scenes; ++seed) {
    LampHunt hunt{unsigned(seed)};
    const std::string text = hunt.text();
    const double tolerance = hunt.chance(0.5) ? 0.01 : 0.002;
    const std::string march_by = hunt.chance(0.2) ? "{ type = \"march\", sun_cache = false }" : "\"march\"";
    const PictureScene march(march_by, text, tolerance, {16, 12}),
        exact("\"exact\"", text, 0.02 * tolerance, {16, 12});
    std::vector<RayResult> got(march.rays().size());
    Counters counters;
    march.tracer().trace(march.rays(), got, counters);
    const std::vector<RayResult> expected = exact.picture(64);
    for (size_t i = 0; i < got.size(); ++i) {
      const double error = largest(got[i].radiance - expected[i].radiance);
      ++rays;
      beyond += !(error <= tolerance);
      EXPECT_LE(error, 4.0 * tolerance)  // that of `exact` is an estimate, too
          << "seed " << seed << ", ray " << i << ": " << got[i].radiance << " for " << expected[i].radiance
          << ", estimated " << got[i].error << '\n'
          << text;
    }
    handed_over += counters["exact_rays"];
  }
  EXPECT_LE(double(beyond), 1e-3 * double(rays));
  RecordProperty("beyond_the_tolerance", fmt::format("{} of {}", beyond, rays));
  RecordProperty("handed_over", fmt::format("{} of {}", handed_over, rays));
  EXPECT_LE(double(handed_over), 0.1 * double(rays));
}

}  // namespace
}  // namespace pileus
