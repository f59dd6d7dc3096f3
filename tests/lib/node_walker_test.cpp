// Walks through the nodes of a pyramid, along friendly and hostile rays.
#include "lib/volume/node_walker.h"

#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "lib/math/box.h"
#include "tests/fixtures/voxel_sources.h"

namespace pileus {
namespace {

class NodeWalkerTest : public testing::Test {
 protected:
  VoxelSources m_voxels = mixed_voxels(21);
  BrickGrid m_grid = m_voxels.build();
  BrickPyramid m_pyramid{m_grid};
  Vec3d m_origin{m_pyramid.origin()};
  Box3d m_box{Vec3d(m_grid.lo()) - m_origin, Vec3d(m_grid.hi()) - m_origin};
  std::mt19937 m_random{22};
  int m_stretches = 0, m_lit = 0;

  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(m_random); }

  Vec3d point() {
    Vec3d p;
    for (int k = 0; k < 3; ++k) p[k] = uniform(m_box.min[k], m_box.max[k]);
    return p;
  }

  /// Checks what the walker promises of one ray through the box. `blur`: how far rounding moves points.
  void check(const Ray& ray, Segment whole = {-1e300, 1e300}, int samples = 3) {
    const Segment segment = clip_to_box(ray, whole, m_box);
    if (segment.empty()) return;
    const auto describe = [&](const NodeWalker::Stretch& stretch) {
      return ::testing::Message() << "ray " << ray.o << " + t " << ray.d << ", segment " << segment.t0
                                  << " .. " << segment.t1 << ", stretch " << stretch.t0 << " .. "
                                  << stretch.t1;
    };
    NodeWalker walker(m_pyramid, ray, segment);
    NodeWalker::Stretch stretch{};
    double t = segment.t0;
    int count = 0;
    while (walker.next(stretch)) {
      ASSERT_EQ(stretch.t0, t) << describe(stretch);
      ASSERT_GE(stretch.t1, stretch.t0) << describe(stretch);
      ASSERT_LE(stretch.t1, segment.t1) << describe(stretch);
      ASSERT_LT(++count, 3 * (m_box.size().x + m_box.size().y + m_box.size().z) / 16 + 10)
          << describe(stretch);
      t = stretch.t1;
      for (int n = 0; n < samples && stretch.t1 > stretch.t0; ++n) {
        const double share = n == 0 ? 0.5 : uniform(0.0, 1.0);
        check_density(ray, stretch.t0 + share * (stretch.t1 - stretch.t0), stretch.range, segment);
        if (HasFatalFailure()) FAIL() << describe(stretch);
      }
      ++m_stretches;
      m_lit += stretch.range.hi > 0.0f;
    }
    ASSERT_EQ(t, segment.t1) << describe(stretch);
  }

  /// The field is Lipschitz, so rounded positions move the density by a known amount.
  void check_density(const Ray& ray, double t, const ValueRange& range, const Segment& segment) {
    const Vec3d p = ray.at(t);
    double moved = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double far = std::max(std::abs(segment.t0), std::abs(segment.t1)) * std::abs(ray.d[k]);
      moved += 8e-16 * (std::abs(ray.o[k]) + far + m_box.max[k]);
    }
    const double slack = 2.0 * 2.5 * moved, rho = m_voxels.density(p + m_origin);
    ASSERT_GE(rho, double(range.lo) - slack) << "at " << p;
    ASSERT_LE(rho, double(range.hi) + slack) << "at " << p;
  }
};

TEST_F(NodeWalkerTest, random_rays) {
  for (int n = 0; n < 6000; ++n) {
    const Vec3d a = point(), b = point();
    check({a, normalize(b - a)});
    check({a - 3.0 * (b - a), normalize(b - a)});
    check({a, b - a}, {0.0, 1.0});
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(m_stretches, 100000);
  EXPECT_GT(m_lit, 10000);
}

TEST_F(NodeWalkerTest, rays_along_axes_edges_and_faces) {
  for (int n = 0; n < 4000; ++n) {
    // Coordinates on planes of cells, bricks or nodes, or none; directions of few components, of both zeros.
    Vec3d o = point(), d(0.0);
    for (int k = 0; k < 3; ++k) {
      const double plane[] = {1.0, 8.0, 16.0, 32.0, 0.0};
      if (const double step = plane[m_random() % 5]; step > 0.0) o[k] = step * std::floor(o[k] / step);
      const double components[] = {0.0, -0.0, 1.0, -1.0, 0.5, -2.0};
      d[k] = components[m_random() % 6];
    }
    if (d == Vec3d(0.0)) continue;
    check({o, d});
    check({o - 1000.0 * d, d});
    check({o, d}, {0.0, 1e300});
    if (HasFatalFailure()) return;
  }
}

TEST_F(NodeWalkerTest, rays_through_corners) {
  for (int n = 0; n < 4000; ++n) {
    const auto corner = [&] {
      Vec3d p = point();
      for (int k = 0; k < 3; ++k) p[k] = 16.0 * std::floor(p[k] / 16.0);
      return p;
    };
    const Vec3d a = corner(), b = corner();
    if (a == b) continue;
    check({a, b - a});
    check({a, normalize(b - a)});
    check({a - (b - a), b - a}, {0.0, 1.5});
    if (HasFatalFailure()) return;
  }
}

TEST_F(NodeWalkerTest, tiny_and_huge_directions) {
  for (int n = 0; n < 4000; ++n) {
    const Vec3d a = point(), b = point();
    const double scale = std::pow(10.0, uniform(-140.0, 140.0));
    check({a, scale * (b - a)});
    Vec3d skew = normalize(b - a);  // nearly along an axis: the others hardly move
    skew[int(m_random() % 3)] *= std::pow(10.0, uniform(-300.0, 0.0));
    skew[int(m_random() % 3)] *= std::pow(10.0, uniform(-30.0, 0.0));
    check({a, skew});
    if (HasFatalFailure()) return;
  }
}

TEST_F(NodeWalkerTest, components_whose_reciprocal_overflows) {
  // 1 / d is infinite, and 0 * infinity stands where the origin lies on a plane.
  for (int n = 0; n < 3000; ++n) {
    Vec3d o = point(), d(0.0);
    for (int k = 0; k < 3; ++k) {
      if (m_random() % 3 != 0) o[k] = 16.0 * std::floor(o[k] / 16.0);
      const double components[] = {1e-310, -1e-310, 5e-324, -5e-324, 1.0, -0.7};
      d[k] = components[m_random() % 6];
    }
    check({o, d}, {-1e5, 1e5});
    if (HasFatalFailure()) return;
  }
}

TEST_F(NodeWalkerTest, segments_of_no_length_and_of_almost_none) {
  for (int n = 0; n < 2000; ++n) {
    const Vec3d a = point();
    const Ray ray{a, normalize(point() - a)};
    NodeWalker nowhere(m_pyramid, ray, {1.0, 1.0}), backwards(m_pyramid, ray, {1.0, 0.5});
    NodeWalker::Stretch stretch;
    EXPECT_FALSE(nowhere.next(stretch));
    EXPECT_FALSE(backwards.next(stretch));
    const double t = uniform(0.0, 30.0);
    check(ray, {t, std::nextafter(t, 1e9)});
    check(ray, {t, t + 1e-9});
    if (HasFatalFailure()) return;
  }
}

TEST_F(NodeWalkerTest, leaps_over_what_is_empty_and_over_tiles) {
  // From -1500 to the next leaves there is nothing for more than a thousand voxels.
  const Ray ray{Vec3d(-1400.5, 300.5, 60.5) - m_origin, {1, 0, 0}};
  NodeWalker walker(m_pyramid, ray, {0.0, 1000.0});
  NodeWalker::Stretch stretch;
  int count = 0;
  while (walker.next(stretch)) ++count;
  EXPECT_LT(count, 20);
}

}  // namespace
}  // namespace pileus
