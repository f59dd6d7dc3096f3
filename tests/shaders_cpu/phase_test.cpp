#include <gtest/gtest.h>

#include "tests/shaders_cpu/make_plugin.h"
#include "tests/shaders_cpu/phase_checks.h"

namespace pileus {
namespace {

TEST(PhaseFunctions, isotropic) {
  const auto phase = make_plugin<PhaseFunction>("isotropic");
  expect_phase_function(*phase, 0.0);
  EXPECT_TRUE(phase->is_isotropic());
}

TEST(PhaseFunctions, hg) {
  for (const double g : {-0.999, -0.7, -1e-9, 0.0, 1e-4, 0.5, 0.85, 0.99, 0.99999}) {
    SCOPED_TRACE(g);
    const auto phase = make_plugin<PhaseFunction>("hg", {{"g", g}});
    expect_phase_function(*phase, g);
    EXPECT_EQ(phase->is_isotropic(), g == 0.0);
    EXPECT_EQ(phase->p({0, 0, 1}, {0, 0, -1}) < phase->p({0, 0, 1}, {0, 0, 1}), g < 0.0);
  }
}

TEST(PhaseFunctions, hg_agrees_with_the_textbook_where_that_is_stable) {
  const double g = 0.6;
  const auto phase = make_plugin<PhaseFunction>("hg", {{"g", g}});
  for (double cosine = -1.0; cosine <= 1.0; cosine += 0.125) {
    const Vec3d wi(std::sqrt(1.0 - cosine * cosine), 0.0, -cosine);
    const double textbook =
        0.25 * std::numbers::inv_pi * (1 - g * g) / std::pow(1 + g * g - 2 * g * cosine, 1.5);
    EXPECT_NEAR(phase->p({0, 0, 1}, wi), textbook, 1e-14 * textbook);
  }
}

TEST(PhaseFunctions, two_lobe) {
  for (const double weight : {0.0, 0.25, 1.0}) {
    SCOPED_TRACE(weight);
    const auto phase = make_plugin<PhaseFunction>(
        "two_lobe", {{"g_forward", 0.9}, {"g_backward", -0.4}, {"weight", weight}});
    expect_phase_function(*phase, weight * 0.9 - (1.0 - weight) * 0.4);
  }
}

TEST(PhaseFunctions, rayleigh) {
  const auto phase = make_plugin<PhaseFunction>("rayleigh");
  expect_phase_function(*phase, 0.0);
  EXPECT_NEAR(phase->p({0, 0, 1}, {0, 0, 1}) / phase->p({0, 0, 1}, {1, 0, 0}), 2.0, 1e-15);
}

}  // namespace
}  // namespace pileus
