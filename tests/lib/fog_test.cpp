// Closed forms of fog against slow integrals of the same fog.
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "lib/fog/fade.h"
#include "lib/fog/fading.h"
#include "lib/fog/fog_on_ray.h"
#include "lib/fog/lit_layer.h"
#include "tests/fixtures/hunt.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
using Law = FogPiece::Law;
using Source = FogPiece::Source;

FogPiece constant_piece(double sigma, const Rgb& colour, double t0 = 0.0, double t1 = kInfinity) {
  FogPiece piece;
  piece.sigma = sigma;
  piece.colour = colour;
  piece.t0 = t0;
  piece.t1 = t1;
  return piece;
}

FogPiece height_piece(double extinction, double scale, double z0, double rise, const Rgb& colour) {
  FogPiece piece;
  piece.law = Law::height;
  piece.profile = {extinction, scale};
  piece.z0 = z0;
  piece.rise = rise;
  piece.colour = colour;
  if (rise < 0.0) piece.t1 = z0 / -rise;
  return piece;
}

/// Optical depth and light over s metres by many small steps: the slow twin.
struct Slow {
  double tau = 0.0;
  Rgb light{0.0};
};
Slow slow_integral(std::span<const FogPiece> pieces, double s, int steps = 60000) {
  Slow sum;
  const double h = s / steps;
  for (int i = 0; i < steps; ++i) {
    const double middle = (i + 0.5) * h;
    double sigma = 0.0;
    Rgb source(0.0);
    for (const FogPiece& piece : pieces) {
      sigma += extinction_at(piece, middle);
      source += extinction_at(piece, middle) * source_at(piece, middle);
    }
    sum.light += source * (h * std::exp(-(sum.tau + 0.5 * h * sigma)));
    sum.tau += h * sigma;
  }
  return sum;
}

void expect_near(const Rgb& got, const Rgb& expected, double tolerance) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[c], expected[c], tolerance) << "channel " << c;
}

std::vector<FogPiece> one_of_each() {
  FogPiece squared = constant_piece(0.001, {0.2, 0.4, 0.9});
  squared.law = Law::linear;
  squared.slope = 3e-5;
  FogPiece fade = constant_piece(0.0, {0.5, 0.6, 0.7});
  fade.law = Law::fade;
  fade.length = 300.0;
  FogPiece graded = constant_piece(0.01, {0.1, 0.9, 0.4});
  graded.colour_slope = {0.3, -0.2, 0.0};
  FogPiece sunlit = constant_piece(0.01, {0.8, 0.7, 0.6});
  sunlit.source = Source::sunlit;
  sunlit.sun_depth = 2.0;
  sunlit.sun_slope = -0.013;
  return {constant_piece(0.02, {0.3, 0.5, 0.7}),
          squared,
          fade,
          graded,
          sunlit,
          height_piece(0.03, 40.0, 5.0, 0.2, {0.6, 0.6, 0.7}),
          height_piece(0.03, 40.0, 90.0, -0.4, {0.6, 0.6, 0.7}),
          height_piece(0.03, 40.0, 20.0, 0.0, {0.6, 0.6, 0.7})};
}

TEST(FogPiece, depth_and_light_are_the_integrals_of_extinction_and_source) {
  for (const FogPiece& piece : one_of_each()) {
    for (const double s : {0.5, 30.0, 200.0}) {
      const Slow slow = slow_integral({&piece, 1}, s);
      EXPECT_NEAR(depth_to(piece, s), slow.tau, 1e-7 * (1.0 + slow.tau));
      expect_near(light_to(piece, s), slow.light, 1e-8);
    }
  }
}

TEST(FogPiece, inverse_gives_back_the_distance) {
  for (const FogPiece& piece : one_of_each()) {
    for (const double s : {1e-9, 0.5, 30.0, 200.0}) {
      EXPECT_NEAR(depth_inverse(piece, depth_to(piece, s)), s, 1e-12 * s);
    }
    EXPECT_EQ(depth_inverse(piece, 0.0), 0.0);
  }
}

TEST(FogPiece, cut_in_two_is_the_same_fog) {
  for (const FogPiece& piece : one_of_each()) {
    const double cut = 70.0, s = 190.0;
    const FogPiece rest = cut_before(piece, cut);
    EXPECT_NEAR(depth_to(piece, cut) + depth_to(rest, s - cut), depth_to(piece, s), 1e-13);
    const Rgb both = light_to(piece, cut) + std::exp(-depth_to(piece, cut)) * light_to(rest, s - cut);
    expect_near(both, light_to(piece, s), 1e-14);
  }
}

TEST(FogPiece, infinite_lengths_and_depths_are_finite_colours) {
  for (FogPiece piece : one_of_each()) {
    if (piece.rise < 0.0 || piece.colour_slope != Rgb(0.0)) continue;
    if (piece.source == Source::sunlit) piece.sun_slope = 0.01;
    const Rgb all = light_to(piece, kInfinity);
    expect_near(all, light_to(piece, 1e7), 1e-9);
  }
  EXPECT_EQ(depth_to(constant_piece(0.0, Rgb(1.0)), kInfinity), 0.0);
  EXPECT_EQ(light_to(constant_piece(1e300, Rgb(0.5)), kInfinity), Rgb(0.5));
}

TEST(FogPiece, thin_fog_keeps_its_relative_accuracy) {
  for (FogPiece piece : one_of_each()) {
    if (piece.law == Law::fade || piece.colour_slope != Rgb(0.0)) continue;
    const double thin = 1e-30;
    piece.sigma *= thin, piece.slope *= thin, piece.profile.extinction *= thin;
    if (piece.source == Source::sunlit) piece.sun_slope *= thin, piece.sun_depth = 0.0;
    const double tau = depth_to(piece, 100.0);
    EXPECT_GT(tau, 0.0);
    EXPECT_NEAR(light_to(piece, 100.0).x / (tau * piece.colour.x), 1.0, 1e-12);
  }
}

TEST(ExponentialHeight, is_stable_at_the_horizon) {
  const HeightProfile profile{0.02, 50.0};
  const double level = height_depth(profile, 30.0, 0.0, 1000.0);
  EXPECT_NEAR(level, 1000.0 * 0.02 * std::exp(-30.0 / 50.0), 1e-15 * level);
  for (const double rise : {1e-300, 1e-20, 1e-12, -1e-300, -1e-20, -1e-12}) {
    EXPECT_NEAR(height_depth(profile, 30.0, rise, 1000.0), level, 2e-10 * level) << rise;
  }
  // Series: tau = level (1 - x / 2 + x^2 / 6 - …), x = rise s / scale.
  for (const double rise : {1e-6, -1e-6}) {
    const double x = rise * 1000.0 / 50.0;
    EXPECT_NEAR(height_depth(profile, 30.0, rise, 1000.0) / level, 1.0 - x / 2.0 + x * x / 6.0, 1e-14);
  }
}

TEST(ExponentialHeight, has_the_limits_of_thin_and_flat_fog) {
  EXPECT_EQ(height_depth({0.0, 50.0}, 30.0, 0.1, kInfinity), 0.0);
  EXPECT_EQ(height_depth({1e-300, 50.0}, 0.0, 1.0, kInfinity), 50.0 * 1e-300);
  // H -> 0: nothing above the base, B H / rise on the way through it.
  for (const double scale : {1e-3, 1e-30, 1e-300}) {
    EXPECT_EQ(height_depth({0.02, scale}, 1.0, 0.5, kInfinity), 0.0);
    EXPECT_DOUBLE_EQ(height_depth({0.02, scale}, 0.0, 0.5, kInfinity), 0.02 * scale / 0.5);
    EXPECT_DOUBLE_EQ(height_depth({0.02, scale}, 1.0, -0.5, 2.0), 0.02 * scale / 0.5);
  }
  EXPECT_EQ(height_depth({0.02, 50.0}, 1e300, 0.3, kInfinity), 0.0);
  EXPECT_EQ(height_depth({0.02, 50.0}, 10.0, 0.0, kInfinity), kInfinity);
}

TEST(ExponentialHeight, inverse_holds_far_above_too) {
  for (const double z0 : {10.0, 2000.0, 60000.0}) {
    const HeightProfile profile{0.02, 50.0};
    const double s = height_depth_inverse(profile, z0, -0.7, 0.01);
    EXPECT_NEAR(height_depth(profile, z0, -0.7, s), 0.01, 1e-12) << z0;
  }
  EXPECT_EQ(height_depth_inverse({0.02, 50.0}, 0.0, 1.0, 1.01), kInfinity);
}

TEST(LitLayer, any_direction_agrees_with_a_slow_integral) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int trial = 0; trial < 40; ++trial) {
    const double extinction = std::pow(10.0, -5.0 + 4.0 * unit(random)), thickness = 100.0;
    const double z = thickness * unit(random), sun = 0.05 + 0.95 * unit(random),
                 rise = 2.0 * unit(random) - 1.0;
    const double length = (rise > 0.0 ? thickness - z : z) / std::abs(rise);
    double sum = 0.0;
    const int steps = 200000;
    for (int i = 0; i < steps; ++i) {
      const double s = (i + 0.5) * length / steps;
      sum += std::exp(-extinction * (s + (thickness - z - s * rise) / sun)) * length / steps;
    }
    EXPECT_NEAR(lit_segment(extinction, thickness - z, length, rise, sun), sum, 1e-7 * sum);
  }
}

TEST(LitLayer, legacy_form_is_a_lower_bound_as_far_off_as_said) {
  const double sine30 = 0.5, sine45 = std::numbers::sqrt2 / 2.0;
  const auto share = [](double b, double h, double depression, double sun) {
    return legacy_lit_layer_light(b, 100.0, h, depression, sun) /
           lit_layer_light(b, 100.0, h, depression, sun);
  };
  EXPECT_NEAR(share(0.001, 20.0, sine30, sine45), 1.0 - 0.014, 5e-3);
  EXPECT_NEAR(share(0.01, 20.0, sine30, sine45), 1.0 - 0.14, 5e-3);
  EXPECT_NEAR(1.0 / share(0.05, 100.0, std::sin(std::numbers::pi / 18.0), 0.5), 16000.0, 500.0);
}

TEST(FogOnRay, overlapping_fogs_agree_with_a_slow_integral) {
  const std::vector<FogPiece> each = one_of_each();
  FogOnRay fog;
  for (size_t a = 0; a < each.size(); ++a) {
    for (size_t b = 0; b <= a; ++b) {
      const std::vector<FogPiece> two{each[a], each[b]};
      fog.start() = two;
      fog.finish(220.0, 1e-10);
      const Slow slow = slow_integral(two, 200.0);
      const Veil veil = fog.to(200.0);
      EXPECT_NEAR(veil.transmittance, std::exp(-slow.tau), 1e-8) << a << ", " << b;
      expect_near(veil.light, slow.light, 2e-8);
      EXPECT_NEAR(fog.depth_inverse(-std::log(veil.transmittance)), 200.0, 1e-8);
    }
  }
}

TEST(FogOnRay, disjoint_layers_composite_as_from_the_farthest_on) {
  FogOnRay fog;
  fog.start() = {constant_piece(0.05, {0.9, 0.1, 0.2}, 40.0, 60.0),
                 constant_piece(0.02, {0.1, 0.8, 0.3}, 10.0, 30.0)};
  fog.finish(kInfinity, 1e-10);
  const Rgb behind(0.3, 0.3, 0.9);
  Rgb seen = std::exp(-1.0) * behind + (1.0 - std::exp(-1.0)) * Rgb(0.9, 0.1, 0.2);
  seen = std::exp(-0.4) * seen + (1.0 - std::exp(-0.4)) * Rgb(0.1, 0.8, 0.3);
  expect_near(fog.to(100.0).over(behind), seen, 1e-15);
  expect_near(fog.to(5.0).over(behind), behind, 0.0);
}

TEST(FogOnRay, a_thin_layer_in_far_reaching_haze_is_not_overlooked) {
  FogOnRay fog;
  const FogPiece haze = constant_piece(1e-5, Rgb(0.5));
  const FogPiece layer = height_piece(0.1, 2.0, 0.0, 1.0, {0.9, 0.2, 0.1});
  fog.start() = {haze, layer};
  fog.finish(kInfinity, 1e-9);
  // The haze dims the layer by less than 1e-4: both can be told apart.
  const Veil veil = fog.to(kInfinity);
  EXPECT_EQ(veil.transmittance, 0.0);
  const double through = std::exp(-0.2);
  expect_near(veil.light, (1.0 - through) * Rgb(0.9, 0.2, 0.1) + through * Rgb(0.5), 2e-5);
}

TEST(FogOnRay, what_comes_after_opaque_fog_does_not_count) {
  FogPiece wall = constant_piece(0.0, {0.2, 0.3, 0.4}, 10.0);
  wall.law = Law::fade;
  wall.length = 0.0;
  FogOnRay fog;
  fog.start() = {wall, constant_piece(1.0, Rgb(9.0), 20.0, 30.0)};
  fog.finish(kInfinity, 1e-9);
  EXPECT_EQ(fog.to(9.999).transmittance, 1.0);
  EXPECT_EQ(fog.to(10.0).transmittance, 0.0);
  EXPECT_EQ(fog.to(100.0).transmittance, 0.0);
  expect_near(fog.to(100.0).light, {0.2, 0.3, 0.4}, 1e-15);
}

/// Where a table errs most: halfway between two entries, at the kinks of the law, and where the table ends.
std::vector<double> hard_distances(const Fading& fading, double reach, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> share(0.0, 1.2);
  std::vector<double> distances{0.0, fading.start, fading.start + reach, kInfinity};
  for (int i = 0; i < 40; ++i) {
    const double entry = std::floor(share(rng) * Fading::kEntries);
    for (const double within : {0.0, 1e-9, 0.5, 1.0 - 1e-9})
      distances.push_back(fading.start + (entry + within) / Fading::kEntries * reach);
    distances.push_back(share(rng) * fading.start);
  }
  return distances;
}

TEST(Fading, table_is_within_2e_4_of_every_law) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> exponent(-12.0, 6.0), start_exponent(-3.0, 4.0), coin(0.0, 1.0);
  double worst = 0.0;
  for (int i = 0; i < hunted(3000); ++i) {
    Fading fading;
    fading.law = std::array{Fading::Law::linear, Fading::Law::exponential,
                            Fading::Law::exponential_squared}[size_t(i % 3)];
    fading.per = Fading::Per::table;
    fading.start = coin(rng) < 0.5 ? 0.0 : std::pow(10.0, start_exponent(rng));
    fading.density = std::pow(10.0, exponent(rng));
    fading.end = fading.start + 1.0 / fading.density;
    fading.prepare();
    const double reach = std::array{1.0, 9.21, std::sqrt(9.21)}[size_t(i % 3)] / fading.density;
    for (const double distance : hard_distances(fading, reach, rng)) {
      const double error = std::abs(fading.shown(distance) - fading.fade(distance));
      ASSERT_LE(error, 2e-4) << "law " << i % 3 << ", density " << fading.density << ", start "
                             << fading.start << ", distance " << distance;
      worst = std::max(worst, error);
    }
  }
  EXPECT_GT(worst, 1e-4) << "the figure is no looser than it has to be";
}

}  // namespace
}  // namespace pileus
