// What rays know of hazes: their optical depths towards suns are as good as is said.
#include "integrators/haze_rays.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/math/box.h"
#include "lib/volume/analytic_fields.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double interpolated(const std::vector<HazeDepth>& nodes, double t) {
  for (size_t n = 1; n < nodes.size(); ++n) {
    const HazeDepth &a = nodes[n - 1], &b = nodes[n];
    if (t <= b.t) return a.depth + (t - a.t) / (b.t - a.t) * (b.depth - a.depth);
  }
  return nodes.back().depth;
}

class HazesOnRays : public testing::Test {
 protected:
  Vec3d point(double reach) { return {uniform(reach), uniform(reach), uniform(reach)}; }
  double uniform(double reach) { return std::uniform_real_distribution<double>(-reach, reach)(random); }

  std::mt19937_64 random{3};
  Box3d bounds{{-500, 0, -500}, {500, 300, 500}};
  std::vector<WorldMedium> hazes;  ///< a fog, and a box in it
  std::vector<Illumination> suns{{normalize(Vec3d(0.3, 0.8, -0.2)), kInfinity, Rgb(1.0)}};

  HazesOnRays() {
    hazes.reserve(2);
    WorldMedium& fog = hazes.emplace_back();
    fog.density = make_height_fog_field(bounds, 60.0);
    fog.extinction = 2e-3;
    WorldMedium& box = hazes.emplace_back();
    box.density = make_box_field({{-50, 10, -30}, {40, 60, 80}});
    box.extinction = 1e-3;
  }
};

TEST_F(HazesOnRays, depths_towards_suns_err_as_little_as_told) {
  constexpr double kAllowed = 4e-5;
  const Box3d grid({300, 100, 300}, {350, 150, 350});
  const std::vector<const WorldMedium*> media{&hazes[0], &hazes[1]};
  const HazeRays rays(media, {&grid, 1}, suns, bounds, kAllowed);
  double most_nodes = 0.0, coarsest = 0.0;
  for (int n = 0; n < 2000; ++n) {
    MarchRay job;
    const Vec3d o(uniform(400), 150 + uniform(140), uniform(400));
    job.ray = {o, normalize(point(400) - o)};
    job.segment = {0.0, kInfinity};
    HazeRays::OnRay own;
    rays.place(job, own);
    if (!own.is_readable) continue;
    const Segment inside = clip_to_box(job.ray, job.segment, bounds);
    for (double share = 0.001; share < 1.0; share += 0.013) {
      const double t = inside.t0 + share * inside.length();
      FieldCounters counters;
      double depth = 0.0;
      for (const WorldMedium* medium : media) {
        depth += medium->extinction *
                 medium->density->column({job.ray.at(t), suns[0].wi}, {0.0, kInfinity}, kInfinity, counters);
      }
      ASSERT_NEAR(interpolated(own.depths[0], t), depth, 2.0 * own.depth_error) << "ray " << n;
    }
    // What it errs by, times what the ray shows of it, is what was allowed.
    double tau = 0.0;
    FieldCounters counters;
    for (const WorldMedium* medium : media)
      tau += medium->extinction * medium->density->column(job.ray, job.segment, kInfinity, counters);
    ASSERT_LE(own.depth_error * -std::expm1(-tau), kAllowed * (1 + 1e-9)) << "ray " << n;
    if (!clip_to_box(job.ray, job.segment, grid).empty()) {
      ASSERT_EQ(own.depth_error, kAllowed);
    }
    most_nodes = std::max(most_nodes, double(own.depths[0].size()));
    coarsest = std::max(coarsest, own.depth_error);
  }
  EXPECT_GT(most_nodes, 10.0);
  EXPECT_LT(most_nodes, 300.0);
  EXPECT_GT(coarsest, 4.0 * kAllowed);
}

/// Outside of what is told, no way to a sun meets a grid.
TEST_F(HazesOnRays, grids_shade_no_more_than_is_told) {
  const std::vector<Box3d> grids{{{-100, 100, -100}, {-40, 140, -60}}, {{80, 50, 90}, {120, 90, 100}}};
  const std::vector<const WorldMedium*> media{&hazes[0]};
  const HazeRays rays(media, grids, suns, bounds, 1e-4);
  int shaded = 0, told = 0, looks = 0;
  for (int n = 0; n < 2000; ++n) {
    MarchRay job;
    const Vec3d o(uniform(400), 150 + uniform(140), uniform(400));
    job.ray = {o, normalize(point(200) - o)};
    job.segment = {0.0, 400.0};
    HazeRays::OnRay own;
    rays.place(job, own);
    for (double t = 0.5; t < 400.0; t += 7.0) {
      const Vec3d p = job.ray.at(t);
      if (!bounds.intersects(p)) break;
      const bool is_told = t >= job.grid_shadows.t0 && t <= job.grid_shadows.t1;
      const bool is_shaded = std::any_of(grids.begin(), grids.end(), [&](const Box3d& grid) {
        return !clip_to_box({p, suns[0].wi}, {0.0, kInfinity}, grid).empty();
      });
      ASSERT_TRUE(is_told || !is_shaded) << "ray " << n << ", t " << t;
      shaded += is_shaded, told += is_told, ++looks;
    }
  }
  EXPECT_GT(shaded, 500);
  EXPECT_LT(told, looks / 2);
}

}  // namespace
}  // namespace pileus
