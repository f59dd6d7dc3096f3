// Hunts for rays that are said to meet no medium and meet one. PILEUS_HUNT multiplies the number of beams.
#include "integrators/clear_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "integrators/march_scene.h"
#include "lib/math/beam.h"
#include "tests/fixtures/hunt.h"
#include "tests/fixtures/random_grid.h"
#include "vdb_io/openvdb/grid_to_field.h"

namespace pileus {
namespace {

class Views {
 public:
  explicit Views(unsigned seed) : m_random(seed) {}

  double number(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(m_random); }
  Vec3d vector(double lo, double hi) { return {number(lo, hi), number(lo, hi), number(lo, hi)}; }

  /// Some small blobs in a box of 128^3 voxels, most of which is empty.
  openvdb::FloatGrid::Ptr blobs() {
    constexpr int kBlobs = 20, kEdge = 5;
    initialize_openvdb();
    auto grid = openvdb::FloatGrid::create(0.0f);
    for (int n = 0; n < kBlobs; ++n) {
      const Vec3d at = vector(0.0, 128.0);
      const openvdb::Coord low(int(at.x), int(at.y), int(at.z));
      grid->fill({low, low.offsetBy(kEdge)}, float(number(0.1, 1.0)), true);
    }
    return grid;
  }

  /// Voxels of about a centimetre and a half, turned and stretched.
  Affine placement() {
    Imath::M44d matrix;
    matrix.setEulerAngles(vector(-3.0, 3.0));
    return Affine::translation(vector(-1.0, 1.0)) * Affine(matrix) * Affine::scaling(vector(0.01, 0.02)) *
           Affine::translation(Vec3d(-64.0));
  }

  /// A tile of 16 x 16 rays in Morton order, from outside or from within the blobs.
  std::vector<Ray> tile() {
    const Vec3d eye = number(0.0, 1.0) < 0.2 ? vector(-0.7, 0.7) : 4.0 * normalize(vector(-1.0, 1.0));
    const Vec3d ahead = normalize(vector(-1.0, 1.0) - eye);
    const Vec3d side = normalize(cross(ahead, vector(-1.0, 1.0))), up = cross(side, ahead);
    const double pixel = std::pow(10.0, number(-4.0, -1.5));
    std::vector<Ray> rays;
    for (unsigned code = 0; code < 256; ++code) {
      unsigned x = 0, y = 0;
      for (unsigned bit = 0; bit < 4; ++bit) {
        x |= (code >> (2 * bit) & 1) << bit;
        y |= (code >> (2 * bit + 1) & 1) << bit;
      }
      rays.push_back({eye, normalize(ahead + pixel * (double(x) * side + double(y) * up))});
    }
    return rays;
  }

 private:
  std::mt19937 m_random;
};

struct Isotropic final : PhaseFunction {
  void describe(ParamTable&) override {}
  double p(const Vec3d&, const Vec3d&) const override { return 0.25 * std::numbers::inv_pi; }
};

World world_of(std::shared_ptr<const DensityField> density) {
  World world;
  WorldMedium& medium = world.media.emplace_back();
  medium.density = std::move(density);
  medium.extinction = 1.0;
  medium.phase = std::make_shared<Isotropic>();
  return world;
}

bool meets_something(const DensityField& field, std::span<const Ray> rays) {
  FieldCounters counters;
  return std::any_of(rays.begin(), rays.end(), [&](const Ray& ray) {
    return field.column(ray, {0.0, std::numeric_limits<double>::infinity()}, 1e9, counters) > 0.0;
  });
}

TEST(ClearView, holds_nothing_and_finds_most_of_what_is_clear) {
  int clear_blocks = 0, found = 0;
  const EffectPlan plan{};
  for (int scene = 0; scene < hunted(10); ++scene) {
    Views views(unsigned(scene) + 1);
    const World world = world_of(field_from_grid(views.blobs(), views.placement()));
    const DensityField& density = *world.media[0].density;
    const MarchWorld march(world, plan, {MarchStorage::Kind::floats, 0.0});
    for (int n = 0; n < 200; ++n) {
      const std::vector<Ray> rays = views.tile();
      std::array<char, kMostClear> clear;
      find_clear(march.kernel, march.media(), rays, clear);
      for (size_t block = 0; block < kMostClear; ++block) {
        const bool meets = meets_something(density, std::span(rays).subspan(block * kClearRays, kClearRays));
        EXPECT_FALSE(meets && clear[block] != 0) << "scene " << scene << ", tile " << n;
        clear_blocks += meets ? 0 : 1;
        found += clear[block] != 0 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(clear_blocks, 2000);
  EXPECT_GT(found, clear_blocks / 2);
}

TEST(ClearView, leaps_over_nothing_where_leaping_is_off) {
  Views views(7);
  const World world = world_of(field_from_grid(views.blobs(), Affine()));
  MarchWorld march(world, EffectPlan{}, {MarchStorage::Kind::floats, 0.0});
  march.kernel.is_leaping = false;
  const Box3d box = world.media[0].density->bounds();
  const std::vector<Ray> through(kClearRays, Ray{box.min - Vec3d(10.0), normalize(box.max - box.min)}),
      beside(kClearRays, Ray{box.min - Vec3d(10.0), {0.0, 0.0, -1.0}});
  char clear = 1;
  find_clear(march.kernel, march.media(), through, {&clear, 1});
  EXPECT_EQ(clear, 0);
  find_clear(march.kernel, march.media(), beside, {&clear, 1});
  EXPECT_EQ(clear, 1);
}

TEST(Beam, seen_from_elsewhere_holds_the_same_rays) {
  Views views(3);
  for (int n = 0; n < hunted(1000); ++n) {
    const Affine to_from = views.placement();
    const std::vector<Ray> rays = views.tile();
    Beam beam;
    for (const Ray& ray : rays) beam.o.extendBy(ray.o), beam.d.extendBy(ray.d);
    const Beam seen = seen_from(to_from, beam);
    for (const Ray& ray : rays) {
      const double t = views.number(0.0, 8.0);
      Box3d box = seen.box(t, t);
      const double margin = 1e-12 * (1.0 + length(box.min) + length(box.max));
      box.min -= Vec3d(margin), box.max += Vec3d(margin);
      EXPECT_TRUE(box.intersects(to_from.point(ray.at(t))));
    }
  }
}

}  // namespace
}  // namespace pileus
