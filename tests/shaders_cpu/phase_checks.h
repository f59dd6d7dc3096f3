#pragma once

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "lib/scene/phase_function.h"

namespace pileus {

/// Towards the light, for light that is scattered by theta into wo = +z: theta = 0 is straight on, wi = -z.
/// `x` is 1 - cos(theta), or 1 + cos(theta) for the backward half.
inline Vec3d direction_to_light(bool is_forward, double x) {
  const double sine = std::sqrt(x * (2.0 - x));
  return {sine, 0.0, is_forward ? x - 1.0 : 1.0 - x};
}

/// The integrals over the sphere of p and of p cos(theta), by Simpson's rule in the logarithm of the distance
/// from either pole: it resolves a peak of any width.
struct PhaseMoments {
  double total = 0.0;
  double mean_cosine = 0.0;
};
inline PhaseMoments phase_moments(const PhaseFunction& phase) {
  constexpr int kIntervals = 4000;
  constexpr double kLogLeast = -40.0;
  const Vec3d wo(0.0, 0.0, 1.0);
  PhaseMoments moments;
  for (const bool is_forward : {true, false}) {
    for (int i = 0; i <= kIntervals; ++i) {
      const double simpson = i == 0 || i == kIntervals ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
      const double x = std::exp(kLogLeast * (1.0 - double(i) / kIntervals));
      const double solid_angle = 2.0 * std::numbers::pi * x * simpson * -kLogLeast / kIntervals / 3.0;
      const double share = solid_angle * phase.p(wo, direction_to_light(is_forward, x));
      moments.total += share;
      moments.mean_cosine += share * (is_forward ? 1.0 - x : x - 1.0);
    }
  }
  return moments;
}

/// What every phase function owes: normalised, with the mean cosine it claims, reciprocal, the same from all
/// sides, finite and >= 0 for every pair of directions, and brighter straight on than back for g > 0.
inline void expect_phase_function(const PhaseFunction& phase, double mean_cosine) {
  const PhaseMoments moments = phase_moments(phase);
  EXPECT_NEAR(moments.total, 1.0, 1e-7);
  EXPECT_NEAR(moments.mean_cosine, mean_cosine, 1e-7);

  const double straight_on = phase.p({0, 0, 1}, {0, 0, -1}), straight_back = phase.p({0, 0, 1}, {0, 0, 1});
  if (mean_cosine > 0.0) {
    EXPECT_GT(straight_on, straight_back);
  }

  for (int i = 0; i < 500; ++i) {
    const double azimuth = 2.4 * i, height = 1.0 - (2 * i + 1) / 500.0,
                 flat = std::sqrt(1.0 - height * height);
    const Vec3d a(flat * std::cos(azimuth), height, flat * std::sin(azimuth));
    for (const Vec3d& b : {Vec3d(0, 0, 1), Vec3d(0, -1, 0), Vec3d(0.6, 0.0, -0.8), a, -a}) {
      const double p = phase.p(a, b);
      ASSERT_TRUE(std::isfinite(p) && p >= 0.0);
      ASSERT_EQ(p, phase.p(b, a)) << "reciprocity";
      ASSERT_NEAR(phase.p(-a, -b), p, 1e-9 * p) << "seen in the mirror";
      ASSERT_NEAR(phase.p({a.z, a.x, a.y}, {b.z, b.x, b.y}), p, 1e-9 * p) << "turned";
    }
  }
}

}  // namespace pileus
