// The uniform marcher converges to the exact integrator with the order of its rule.
#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "tests/fixtures/traced_scene.h"

namespace pileus {
namespace {

// All effects, smooth along every ray and of the same length in steps for all rays: orders show undisturbed.
constexpr const char* kSmoothScene = R"(
[volume.fog]
type = "height_fog"
base = 0
scale_height = 3
top = 4
extent = 8
extinction = 0.4
albedo = [0.9, 0.8, 0.7]
emission = [0.01, 0.02, 0.03]
phase = { type = "hg", g = 0.3 }
multiple_scattering = { octaves = 5 }
powder = { strength = 0.6 }
ambient = { bottom = [0.1, 0.1, 0.1], top = [0.4, 0.5, 0.6] }
[light.sun]
type = "sun"
direction = [0, 1, 0]
irradiance = [2, 2, 2]
)";

std::string with_step(const std::string& sample, double step) {
  return fmt::format("[render]\nintegrator = {{ type = \"uniform\", sample = \"{}\", step = {} }}\n", sample,
                     step) +
         kSmoothScene;
}

/// Least-squares slope of log2(error) against log2(step).
double fitted_order(const std::string& sample) {
  const Ray ray{{0, 12.0, 0}, {0, -1, 0}};
  const double exact = TracedScene(kSmoothScene, 1e-12).trace(ray).radiance.x;
  std::vector<double> x, y;
  for (int level = 4; level <= 7; ++level) {
    const double step = 12.0 / (1 << level);
    const double got = TracedScene(with_step(sample, step)).trace(ray).radiance.x;
    x.push_back(std::log2(step));
    y.push_back(std::log2(std::abs(got - exact)));
  }
  double mean_x = 0, mean_y = 0, xy = 0, xx = 0;
  for (size_t i = 0; i < x.size(); ++i) mean_x += x[i] / double(x.size()), mean_y += y[i] / double(y.size());
  for (size_t i = 0; i < x.size(); ++i)
    xy += (x[i] - mean_x) * (y[i] - mean_y), xx += (x[i] - mean_x) * (x[i] - mean_x);
  return xy / xx;
}

TEST(Uniform, middle_samples_converge_with_order_two) {
  EXPECT_NEAR(fitted_order("middle"), 2.0, 0.1);
}

TEST(Uniform, left_samples_as_printed_converge_with_order_one) {
  EXPECT_NEAR(fitted_order("left"), 1.0, 0.1);
}

TEST(Uniform, homogeneous_media_are_exact_at_any_step) {
  const char* box = R"(
[volume.box]
type = "box"
extinction = 1.5
albedo = [0, 0, 0]
[background]
type = "constant"
radiance = [1, 1, 1]
)";
  for (const double step : {0.3, 0.7, 5.0}) {
    const std::string text =
        fmt::format("[render]\nintegrator = {{ type = \"uniform\", step = {} }}\n", step) + box;
    const RayResult result = TracedScene(text).trace({{0.1, 0.1, 5}, {0, 0, -1}});
    // The last step's sample may lie beyond the end of the box, where it finds nothing.
    const double covered = step * std::floor(2.0 / step + 0.5 - 1e-9);
    EXPECT_NEAR(result.transmittance, std::exp(-1.5 * std::min(2.0, covered)), 1e-12) << step;
  }
}

TEST(Uniform, refuses_a_step_that_would_never_end) {
  const auto trace_with = [](double step) {
    return TracedScene(fmt::format("[render]\nintegrator = {{ type = \"uniform\", step = {} }}\n", step) +
                       "[volume.box]\ntype = \"box\"\n");
  };
  EXPECT_THROW(trace_with(1e-12), Error);
  EXPECT_NO_THROW(trace_with(1e-3));
}

TEST(Uniform, agrees_with_exact_on_solids) {
  const char* text = R"(
[object.ground]
type = "plane"
[object.ball]
type = "sphere"
center = [0, 1, 0]
[light.sun]
type = "sun"
)";
  const TracedScene exact(text), uniform(std::string("[render]\nintegrator = \"uniform\"\n") + text);
  for (int n = 0; n < 100; ++n) {
    const Ray ray{{0, 3, 8}, normalize(Vec3d(0.1 * (n % 10) - 0.5, -0.05 * (n / 10), -1))};
    EXPECT_EQ(exact.trace(ray).radiance, uniform.trace(ray).radiance);
    EXPECT_EQ(exact.trace(ray).z_first, uniform.trace(ray).z_first);
  }
}

}  // namespace
}  // namespace pileus
