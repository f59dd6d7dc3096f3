// The bounds of one octave: constants proved by subdivision, boxes hunted for violations.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/noise/fbm.h"
#include "lib/noise/perlin_bounds.h"
#include "tests/fixtures/slow_tests.h"

namespace pileus {
namespace {

double fade(double t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}
double fade1(double t) {
  return 30 * t * t * (1 - t) * (1 - t);
}
double fade2(double t) {
  return 60 * t * (1 - t) * (1 - 2 * t);
}

/// What one corner (bit k: at 1 along axis k) adds to noise, slopes and curvatures is dot(gradient, a): `a`
/// for its weight along one axis and the derivatives of that, with the way to the corner.
struct CornerAxis {
  double way, w, w1, w2;

  CornerAxis(double t, bool far)
      : way(far ? t - 1 : t),
        w(far ? fade(t) : 1 - fade(t)),
        w1(far ? fade1(t) : -fade1(t)),
        w2(far ? fade2(t) : -fade2(t)) {}
};

using Corner = std::array<CornerAxis, 3>;

/// dot(gradient, a) is largest for the edge gradient along the two longest components.
double best_gradient(const Vec3d& a) {
  const double x = std::fabs(a.x), y = std::fabs(a.y), z = std::fabs(a.z);
  return x + y + z - std::min({x, y, z});
}

/// Supremum over all gradients, at a place in the cell, of a linear functional of the noise.
using Functional = std::function<double(const Vec3d& place)>;

template <class Part>
double sum_of_corners(const Vec3d& place, const Part& a) {
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    sum += best_gradient(a(Corner{CornerAxis(place.x, corner & 1), CornerAxis(place.y, corner & 2),
                                  CornerAxis(place.z, corner & 4)}));
  }
  return sum;
}

Vec3d way(const Corner& c) {
  return {c[0].way, c[1].way, c[2].way};
}

Vec3d weight_gradient(const Corner& c) {
  return {c[0].w1 * c[1].w * c[2].w, c[0].w * c[1].w1 * c[2].w, c[0].w * c[1].w * c[2].w1};
}

double highest_value(const Vec3d& place) {
  return sum_of_corners(place, [](const auto& c) { return way(c) * (c[0].w * c[1].w * c[2].w); });
}

/// of d . gradient(n)
double highest_slope(const Vec3d& place, const Vec3d& d) {
  return sum_of_corners(place, [&](const auto& c) {
    return way(c) * dot(weight_gradient(c), d) + d * (c[0].w * c[1].w * c[2].w);
  });
}

/// of sum_k diagonal_k n_kk + 2 (n_xy + n_xz + sign n_yz)
double highest_curvature(const Vec3d& place, const Vec3d& diagonal, double sign) {
  return sum_of_corners(place, [&](const auto& c) {
    const double second =
        diagonal.x * c[0].w2 * c[1].w * c[2].w + diagonal.y * c[0].w * c[1].w2 * c[2].w +
        diagonal.z * c[0].w * c[1].w * c[2].w2 +
        2 * (c[0].w1 * c[1].w1 * c[2].w + c[0].w1 * c[1].w * c[2].w1 + sign * c[0].w * c[1].w1 * c[2].w1);
    const Vec3d w = weight_gradient(c);
    return way(c) * second + 2.0 * Vec3d(diagonal.x * w.x + w.y + w.z, w.x + diagonal.y * w.y + sign * w.z,
                                         w.x + sign * w.y + diagonal.z * w.z);
  });
}

/// Whether the functional stays below `bound` in a cube: `growth` is how fast it changes along one axis at
/// most.
bool stays_below(const Functional& f, double bound, double growth, const Vec3d& centre, double half_edge) {
  if (f(centre) + 3 * growth * half_edge <= bound) return true;
  if (half_edge < 1e-5) return false;
  for (int child = 0; child < 8; ++child) {
    const Vec3d side(child & 1 ? 1 : -1, child & 2 ? 1 : -1, child & 4 ? 1 : -1);
    if (!stays_below(f, bound, growth, centre + 0.5 * half_edge * side, 0.5 * half_edge)) return false;
  }
  return true;
}

/// In the corner octant of the cell: the other seven are its mirror images.
bool stays_below(const Functional& f, double bound, double growth) {
  return stays_below(f, bound, growth, Vec3d(0.25), 0.25);
}

TEST(PerlinBound, holds_for_every_choice_of_gradients) {
  // Along one axis highest_value changes by at most 1 (the ramps) plus max fade'(t) |1 - 2t| < 0.54 (the
  // weights) per unit.
  EXPECT_TRUE(stays_below(highest_value, kPerlinBound, 1.54));
}

TEST(PerlinBound, is_tight) {
  EXPECT_GT(highest_value(Vec3d(0.5, 0.4825, 0.355)), kPerlinBound - 0.001);
}

// How fast the functionals change along an axis: with 1 for the sum of a corner pair's weights along an
// axis, 3.75, 11.55 and 120 for the sums of their derivatives, ways of at most 1 and two components per
// gradient,
//   one slope:        2 * 3.75^2 + 3.75 + 3.75 < 36
//   sum of slopes:    2 * (11.55 + 2 * 3.75^2) + 3 * 3.75 + 2 * 3.75 < 99
//   all curvatures:   2 * 486 + 120 + 2 * 2 * 40 < 1260

TEST(PerlinBound, slope_along_an_axis_holds_for_every_choice_of_gradients) {
  const auto slope = [](const Vec3d& p) { return highest_slope(p, Vec3d(1, 0, 0)); };
  EXPECT_TRUE(stays_below(slope, kPerlinSlope, 36));
  EXPECT_NEAR(slope(Vec3d(0.5)), 3.75, 1e-12);
}

/// Signs of the slopes and curvatures that a sum picks; other signs are mirror images of these.
constexpr int kMirrors[2] = {1, -1};

TEST(PerlinBound, sum_of_slopes_is_tight) {
  EXPECT_GT(highest_slope(Vec3d(0.4, 0.5, 0.6), Vec3d(1, 1, 1)), kPerlinCubeSlope - 0.1);
}

TEST(PerlinBound, curvature_is_tight) {
  EXPECT_GT(highest_curvature(Vec3d(0.4, 0.5, 0.6), {1, 1, 1}, 1), kPerlinCubeCurvature - 1.5);
}

// The two proofs that take long.

TEST(PerlinBoundSlow, sum_of_slopes_holds_for_every_choice_of_gradients) {
  if (!wants_slow_tests()) GTEST_SKIP() << "set PILEUS_SLOW_TESTS=1 for this proof";
  const auto slopes = [](const Vec3d& p) { return highest_slope(p, Vec3d(1, 1, 1)); };
  EXPECT_TRUE(stays_below(slopes, kPerlinCubeSlope, 99));
}

TEST(PerlinBoundSlow, curvature_holds_for_every_choice_of_gradients) {
  if (!wants_slow_tests()) GTEST_SKIP() << "set PILEUS_SLOW_TESTS=1 for this proof";
  // sum n_kl d_k d_l <= (positive n_kk) + 2 (|n_xy| + |n_xz| + |n_yz|): every choice of what is positive.
  for (const Vec3d& diagonal : {Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(1, 1, 0), Vec3d(1, 1, 1)}) {
    for (const int sign : kMirrors) {
      const auto curvature = [&](const Vec3d& p) { return highest_curvature(p, diagonal, sign); };
      EXPECT_TRUE(stays_below(curvature, kPerlinCubeCurvature, 1260)) << diagonal << sign;
    }
  }
}

/// Plain noise, in lattice units.
Fbm one_octave(int seed) {
  return Fbm({.octaves = 1, .seed = seed});
}

/// A box of random size somewhere: around lattice points, inside of cells, thin, far out.
Box3d random_box(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double reach = random() % 4 == 0 ? 1e6 : 10;
  const double size = std::exp2(-12 * unit(random) + 1);
  Box3d box;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = random() % 4 == 0 ? std::round(reach * unit(random)) : reach * (2 * unit(random) - 1);
    box.min[axis] = low;
    box.max[axis] = low + (random() % 8 == 0 ? 0 : size * unit(random));
  }
  return box;
}

/// A point of the box: inside, on a face, in a corner or one step of a double from it.
Vec3d random_point(std::mt19937_64& random, const Box3d& box) {
  std::uniform_real_distribution<double> unit(0, 1);
  Vec3d p;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = box.min[axis], high = box.max[axis];
    switch (random() % 5) {
      case 0:
        p[axis] = low;
        break;
      case 1:
        p[axis] = high;
        break;
      case 2:
        p[axis] = std::min(std::nextafter(low, 1e300), high);
        break;
      case 3:
        p[axis] = std::max(std::nextafter(high, -1e300), low);
        break;
      default:
        p[axis] = std::min(low + unit(random) * (high - low), high);
    }
  }
  return p;
}

TEST(PerlinBound, boxes_hold_the_values_in_them) {
  std::mt19937_64 random(71);
  const Fbm noise = one_octave(2);
  const int boxes = wants_slow_tests() ? 1'000'000 / 16 : 2000;
  for (int n = 0; n < boxes; ++n) {
    const Box3d box = random_box(random);
    const Interval bound = noise.bound(OctaveSum::fbm, box, 1 + n % 4);
    for (int i = 0; i < 16; ++i) {
      const Vec3d p = random_point(random, box);
      ASSERT_TRUE(bound.contains(noise.value(OctaveSum::fbm, p))) << box.min << box.max << p;
    }
  }
}

TEST(PerlinBound, small_boxes_are_tight) {
  std::mt19937_64 random(72);
  std::uniform_real_distribution<double> coordinate(-100, 100);
  const Fbm noise = one_octave(0);
  double width = 0, seen = 0;
  for (int n = 0; n < 500; ++n) {
    const Vec3d low(coordinate(random), coordinate(random), coordinate(random));
    const Box3d box(low, low + Vec3d(0.05));
    Interval values{2, -2};
    for (int i = 0; i < 64; ++i) {
      const double value = noise.value(OctaveSum::fbm, random_point(random, box));
      values = hull(values, {value, value});
    }
    width += noise.bound(OctaveSum::fbm, box).width();
    seen += values.width();
  }
  EXPECT_LT(width, 1.3 * seen);
}

TEST(PerlinBound, large_and_infinite_boxes_get_the_bound_of_all_space) {
  const Fbm noise = one_octave(0);
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Box3d& box : {Box3d(Vec3d(0), Vec3d(10)), Box3d(Vec3d(-infinity), Vec3d(infinity)),
                           Box3d(Vec3d(-1e300), Vec3d(1e300)), Box3d(Vec3d(-1e-9), Vec3d(1e9))}) {
    EXPECT_NEAR(noise.bound(OctaveSum::fbm, box).lo, -kPerlinBound, 1e-4);
    EXPECT_NEAR(noise.bound(OctaveSum::fbm, box).hi, kPerlinBound, 1e-4);
    EXPECT_NEAR(noise.bound(OctaveSum::ridged, box).hi, 1, 1e-4);
    EXPECT_EQ(noise.bound(OctaveSum::ridged, box).lo, 0);
    EXPECT_EQ(noise.bound(OctaveSum::billow, box).lo, 0);
  }
}

}  // namespace
}  // namespace pileus
