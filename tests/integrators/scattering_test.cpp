// Octaves of scattering, powder and ambient light, against integrals of their formulas done here by a fine
// rule.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/fixtures/random_grid.h"
#include "tests/fixtures/temp_folder.h"
#include "tests/fixtures/traced_scene.h"

namespace pileus {
namespace {

constexpr double kIsotropic = 0.25 * std::numbers::inv_pi;
const std::string kUniform = "[render]\nintegrator = { type = \"uniform\", step = 0.002 }\n";

/// Integral of f over [a, b] by Simpson's rule.
double integral(double a, double b, const std::function<double(double)>& f) {
  constexpr int kParts = 4000;
  const double h = (b - a) / kParts;
  double sum = f(a) + f(b);
  for (int i = 1; i < kParts; ++i) sum += (i % 2 ? 4.0 : 2.0) * f(a + i * h);
  return sum * h / 3.0;
}

double hg(double cos_theta, double g) {
  return kIsotropic * (1 - g * g) / std::pow(1 + g * g - 2 * g * cos_theta, 1.5);
}

/// A slab 0 < y < 2 under a sun in the zenith, looked at from above along a slanted ray.
struct Slab {
  double extinction = 1.5, albedo = 0.8, g = 0.6, irradiance = 3.0;
  int octaves = 1;
  double a = 0.5, b = 0.5, c = 0.5, strength = 0.0, k = 2.0;
  double bottom = 0.0, top = 0.0;

  std::string text() const {
    return fmt::format(R"(
[volume.slab]
type = "box"
min = [-1e3, 0, -1e3]
max = [1e3, 2, 1e3]
extinction = {}
albedo = [{}, 0.5, 0]
phase = {{ type = "hg", g = {} }}
multiple_scattering = {{ octaves = {}, extinction = {}, contribution = {}, phase = {} }}
powder = {{ strength = {}, extinction = {} }}
ambient = {{ bottom = [{}, 0, 0], top = [{}, 0, 0] }}
[light.sun]
type = "sun"
direction = [0, 1, 0]
irradiance = [{}, 0, 0]
)",
                       extinction, albedo, g, octaves, a, b, c, strength, k, bottom, top, irradiance);
  }

  /// The formula, word for word.
  double source(double depth, double cos_theta) const {
    const double tau = extinction * depth, p = hg(cos_theta, g);
    double light = 0.0;
    for (int i = 0; i < octaves; ++i) {
      const double p_i = kIsotropic + std::pow(c, i) * (p - kIsotropic);
      light += std::pow(b, i) * p_i * std::exp(-std::pow(a, i) * tau) * (1 - strength * std::exp(-k * tau));
    }
    return albedo * (irradiance * light + bottom + (top - bottom) * (1 - depth / 2));
  }

  double radiance(double mu) const {
    return integral(0.0, 2.0 / mu, [&](double s) {
      // The light goes down and turns back up: the angle between its path and the viewer's has cosine -mu.
      return source(s * mu, -mu) * extinction * std::exp(-extinction * s);
    });
  }
};

std::vector<Slab> slabs() {
  std::vector<Slab> all(7);
  all[1].octaves = 8;
  all[2].octaves = 16, all[2].a = 0.3, all[2].b = 0.9, all[2].c = 1.0;
  all[3].strength = 1.0;
  all[4].bottom = 0.2, all[4].top = 0.9;
  all[5] = {20.0, 1.0, -0.3, 5.0, 5, 0.4, 0.6, 0.7, 0.5, 3.0, 0.7, 0.1};
  all[6] = {0.01, 0.9, 0.9, 100.0, 3, 1.0, 1.0, 0.2, 0.9, 0.1, 0.0, 0.01};
  return all;
}

TEST(Scattering, slabs_follow_the_formula) {
  const double mu = 0.8;
  const Ray ray{{0, 5, 0}, {0.6, -mu, 0}};
  for (const Slab& slab : slabs()) {
    const double expected = slab.radiance(mu);
    for (const double tolerance : {0.0, 1e-6, 1e-3}) {
      const RayResult result = TracedScene(slab.text(), tolerance).trace(ray);
      EXPECT_NEAR(result.radiance.x, expected, std::max(1e-7 * expected, tolerance)) << slab.text();
      EXPECT_LE(result.error, std::max(1e-7 * expected, tolerance)) << slab.text();
    }
    EXPECT_NEAR(TracedScene(kUniform + slab.text()).trace(ray).radiance.x, expected, 2e-3 * expected)
        << slab.text();
  }
}

TEST(Scattering, a_response_that_ends_slowly_is_not_cut_short) {
  // Light through an absorber of optical depth 60: nothing of the first octave, all there is of the last.
  const auto scene = [](const char* integrator, double tolerance) {
    return TracedScene(fmt::format("[render]\nintegrator = \"{}\"\n", integrator) + R"(
[volume.lid]
type = "box"
min = [-1e3, 5, -1e3]
max = [1e3, 6, 1e3]
extinction = 60
albedo = [0, 0, 0]
[volume.haze]
type = "box"
min = [-1, -1, -1]
max = [1, 1, 1]
extinction = 1e-3
multiple_scattering = { octaves = 8, contribution = 0.9 }
[light.sun]
type = "sun"
direction = [0, 1, 0]
irradiance = [2e5, 2e5, 2e5]
)",
                       tolerance);
  };
  double response = 0.0;
  for (int i = 0; i < 8; ++i) {
    response += kIsotropic * std::pow(0.9, i) * std::exp(-std::pow(0.5, i) * (60 + 1e-3 * 1));
  }
  const double expected = 2e5 * response * -std::expm1(-2e-3);
  for (const double tolerance : {0.0, 1e-4, 0.01}) {
    EXPECT_NEAR(scene("exact", tolerance).trace({{0, 0, 5}, {0, 0, -1}}).radiance.x, expected,
                std::max(1e-7 * expected, tolerance));
    EXPECT_NEAR(scene("uniform", tolerance).trace({{0, 0, 5}, {0, 0, -1}}).radiance.x, expected,
                0.02 * expected);
  }
}

TEST(Scattering, exact_stays_within_its_tolerance_with_all_effects_on) {
  const TempFolder folder;
  write_grid(folder / "grid.vdb", random_grid(10, 4));
  const std::string text = fmt::format(R"(
[volume.grid]
type = "vdb"
file = "{}"
extinction = 3
phase = {{ type = "hg", g = 0.5 }}
multiple_scattering = {{ octaves = 6 }}
powder = {{ strength = 0.7 }}
ambient = {{ bottom = [0.1, 0.2, 0.3], top = [0.4, 0.5, 0.9] }}
[volume.veil]
type = "ellipsoid"
center = [5, 5, 5]
radii = [9, 4, 4]
extinction = 0.1
multiple_scattering = {{ octaves = 2, extinction = 0.8 }}
[light.sun]
type = "sun"
direction = [0.3, 0.8, 0.5]
irradiance = [20, 15, 10]
[light.back]
type = "sun"
direction = [0.3, -0.2, -0.5]
irradiance = [1, 3, 5]
)",
                                       (folder / "grid.vdb").string());
  const TracedScene tight(text, 1e-7);
  for (const double tolerance : {0.05, 0.002}) {
    const TracedScene loose(text, tolerance);
    for (int n = 0; n < 30; ++n) {
      const Ray ray{{-20, 5 + 0.2 * (n % 12), 9}, normalize(Vec3d(1, 0.02 * n - 0.3, -0.2))};
      const RayResult a = loose.trace(ray), b = tight.trace(ray);
      EXPECT_LE(a.error, tolerance);
      for (int channel = 0; channel < 3; ++channel) {
        EXPECT_NEAR(a.radiance[channel], b.radiance[channel], tolerance) << "ray " << n;
      }
    }
  }
}

TEST(Scattering, a_white_medium_in_the_light_of_its_background_cannot_be_seen) {
  // No light, several media, one black inside of nothing else: what is dimmed comes back as sky.
  const std::string text = R"(
[background]
type = "constant"
radiance = [0.3, 0.5, 0.9]
[volume.ball]
type = "ellipsoid"
radii = [1, 2, 3]
extinction = 4
ambient = { bottom = [0.3, 0.5, 0.9], top = [0.3, 0.5, 0.9] }
[volume.fog]
type = "height_fog"
base = -1
top = 1
extent = 5
scale_height = 0.5
extinction = 2
ambient = { bottom = [0.3, 0.5, 0.9], top = [0.3, 0.5, 0.9] }
)";
  const TracedScene exact(text, 1e-9), uniform(kUniform + text);
  for (int n = 0; n < 40; ++n) {
    const Ray ray{{0.1, 0.3, 8}, normalize(Vec3d(0.03 * (n % 8) - 0.1, 0.05 * (n / 8) - 0.1, -1))};
    const RayResult seen = exact.trace(ray), marched = uniform.trace(ray);
    for (int channel = 0; channel < 3; ++channel) {
      const double sky = Rgb(0.3, 0.5, 0.9)[channel];
      EXPECT_NEAR(seen.radiance[channel], sky, 1e-8) << n;
      EXPECT_NEAR(marched.radiance[channel], sky, 1e-9) << n << ": each step balances by itself";
    }
  }
}

TEST(Scattering, what_is_off_leaves_every_bit_alone) {
  Slab plain;
  const std::string text = plain.text();
  std::string bare = text;
  for (const char* key : {"multiple_scattering", "powder", "ambient"}) {
    const size_t at = bare.find(key);
    bare.erase(at, bare.find('\n', at) - at);
  }
  for (const std::string& integrator : {std::string(), kUniform}) {
    const Ray ray{{0, 5, 0}, {0.6, -0.8, 0}};
    EXPECT_EQ(TracedScene(integrator + text, 1e-3).trace(ray).radiance,
              TracedScene(integrator + bare, 1e-3).trace(ray).radiance);
  }
}

TEST(Scattering, surfaces_are_lit_through_plain_transmittance) {
  const TracedScene scene(R"(
[volume.box]
type = "box"
min = [-1, 1, -1]
max = [1, 3, 1]
extinction = 0.4
albedo = [0, 0, 0]
multiple_scattering = { octaves = 8 }
powder = { strength = 1 }
ambient = { top = [1, 1, 1] }
[object.ground]
type = "plane"
shader = { type = "phong", diffuse = [1, 1, 1], specular = [0, 0, 0], ambient = [0, 0, 0] }
[light.sun]
type = "sun"
direction = [0, 1, 0]
irradiance = [3, 3, 3]
)");
  EXPECT_NEAR(scene.trace({{5, 0.5, 0}, normalize(Vec3d(-4.5, -0.5, 0))}).radiance.x,
              3 * std::numbers::inv_pi * std::exp(-0.8), 1e-12);
}

}  // namespace
}  // namespace pileus
