// Hazes that shade each other, in the march.
#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pileus/pileus.h"

namespace pileus {
namespace {

/// A ball of haze whose shadow lies in a long thin veil, seen from within the veil.
Image ball_over_veil(const std::string& integrator, double tolerance) {
  const std::string text = fmt::format(R"(pileus = 1
[render]
size = [32, 18]
integrator = "{}"
tolerance = {}
[camera]
type = "perspective"
position = [0, 0.6, 7.6]
look_at = [0, 0.24, 0]
fov_deg = 46
[light.key]
type = "sun"
direction = [-0.6, 0.9, 0.55]
irradiance = [19, 19, 19]
[volume.ball]
type = "ellipsoid"
center = [-0.75, 0.4, 0]
radii = [1.2, 1.2, 1.2]
extinction = 1.8
[volume.veil]
type = "box"
min = [-6, -3, -4]
max = [6, 4, 9]
extinction = 0.012
phase = {{ type = "hg", g = 0.5 }}
)",
                                       integrator, tolerance);
  return render(parse_scene(text, "test", ""), {}).image;
}

TEST(HazeShadows, steps_through_a_veil_see_the_shadow_that_lies_in_it) {
  const Image exact = ball_over_veil("exact", 1e-6);
  for (const double tolerance : {0.01, 0.002, 0.0005, 0.0001}) {
    const Image march = ball_over_veil("march", tolerance);
    double worst = 0.0;
    for (const char* channel : {"R", "G", "B"}) {
      const auto &a = march.find(channel)->values, &b = exact.find(channel)->values;
      for (size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(double(a[i]) - double(b[i])));
    }
    EXPECT_LT(worst, tolerance);
  }
}

}  // namespace
}  // namespace pileus
