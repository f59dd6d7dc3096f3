// The response of a medium to light as a sum of exponentials, and the light of the sky around it.
#include "lib/scene/scattering.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/scene/world.h"
#include "lib/volume/analytic_fields.h"

namespace pileus {
namespace {

constexpr double kIsotropic = 0.25 * std::numbers::inv_pi;

TEST(Scattering, single_scattering_is_one_plain_term) {
  const std::vector<ScatterTerm> terms = scatter_terms({}, {});
  ASSERT_EQ(terms.size(), 1u);
  EXPECT_EQ(terms[0].scale, 1.0);
  EXPECT_EQ(terms[0].extinction, 1.0);
  EXPECT_EQ(terms[0].anisotropy, 1.0);
  for (const double p : {0.0, 1e-300, 0.1, 1.0 / 3.0, 3e7}) {
    EXPECT_EQ(phase_weight(terms[0], p), p) << "to the last bit";
    EXPECT_EQ(scatter_response(terms, p, 0.7), p * std::exp(-0.7));
  }
}

TEST(Scattering, octaves_and_powder_give_their_terms_in_order) {
  const std::vector<ScatterTerm> terms = scatter_terms({3, 0.5, 0.25, 0.75}, {0.5, 2.0});
  const double expected[][3] = {{1, 1, 1},           {-0.5, 3, 1},           {0.25, 0.5, 0.75},
                                {-0.125, 2.5, 0.75}, {0.0625, 0.25, 0.5625}, {-0.03125, 2.25, 0.5625}};
  ASSERT_EQ(terms.size(), std::size(expected));
  for (size_t i = 0; i < terms.size(); ++i) {
    EXPECT_DOUBLE_EQ(terms[i].scale, expected[i][0]) << i;
    EXPECT_DOUBLE_EQ(terms[i].extinction, expected[i][1]) << i;
    EXPECT_DOUBLE_EQ(terms[i].anisotropy, expected[i][2]) << i;
  }
}

TEST(Scattering, the_response_never_exceeds_its_bound_nor_falls_below_zero) {
  for (const double strength : {0.0, 0.3, 1.0}) {
    for (const double p : {0.0, kIsotropic, 5.0}) {
      const std::vector<ScatterTerm> terms = scatter_terms({7, 0.4, 0.8, 0.6}, {strength, 3.0});
      for (double from = 0.0; from < 40.0; from += 1.7) {
        const double bound = scatter_response_bound(terms, p, from);
        for (double tau = from; tau < from + 30.0; tau += 0.31) {
          const double response = scatter_response(terms, p, tau);
          EXPECT_LE(response, bound);
          EXPECT_GE(response, -1e-16);
        }
      }
    }
  }
}

TEST(Scattering, each_octave_of_a_phase_function_stays_normalised) {
  // The mean of p over the sphere is 1/(4 pi), so that of each octave must be its scale times that.
  for (const ScatterTerm& term : scatter_terms({4, 0.5, 0.5, 0.3}, {})) {
    const double mean = 0.5 * (phase_weight(term, 0.5 * kIsotropic) + phase_weight(term, 1.5 * kIsotropic));
    EXPECT_DOUBLE_EQ(mean, term.scale * kIsotropic);
  }
}

TEST(Scattering, ambient_light_is_linear_between_the_ends_of_the_volume) {
  const auto field = make_box_field(Box3d(Vec3d(-1, 2, -1), Vec3d(1, 6, 1)));
  const SkyAround sky{{1, 2, 3}, {3, 0, 1}};
  const AmbientLight light = ambient_light(sky, *field, "fog");
  EXPECT_TRUE(light.is_on());
  EXPECT_EQ(light.at(-5), Rgb(3, 0, 1));
  EXPECT_EQ(light.at(2), Rgb(3, 0, 1));
  EXPECT_EQ(light.at(3), Rgb(2.5, 0.5, 1.5));
  EXPECT_EQ(light.at(6), Rgb(1, 2, 3));
  EXPECT_EQ(light.at(1e300), Rgb(1, 2, 3));
  EXPECT_FALSE(AmbientLight{}.is_on());
  EXPECT_EQ(AmbientLight{}.at(0.5), Rgb(0, 0, 0));
}

TEST(Scattering, a_volume_without_ends_has_one_ambient_light_or_none) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const auto& [y0, y1] : {std::pair(-kInfinity, 0.0), std::pair(0.0, kInfinity)}) {
    const auto field = make_box_field(Box3d(Vec3d(-1, y0, -1), Vec3d(1, y1, 1)));
    const AmbientLight even = ambient_light({{1, 2, 3}, {1, 2, 3}}, *field, "fog");
    EXPECT_EQ(even.at(-7), Rgb(1, 2, 3));
    try {
      ambient_light({{1, 2, 3}, {1, 2, 4}}, *field, "fog");
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::scene);
      EXPECT_EQ(std::string(error.what()).find("error: volume \"fog\": ambient top = [1, 2, 3] differs"), 0u)
          << error.what();
    }
  }
}

TEST(Scattering, worlds_carry_the_terms_and_the_sky_of_each_volume) {
  const World world = build_world(parse_scene(R"(pileus = 1
camera = "perspective"
[volume.plain]
type = "box"
[volume.rich]
type = "ellipsoid"
center = [0, 3, 0]
multiple_scattering = { octaves = 4 }
powder = { strength = 0.5 }
ambient = { top = [0, 0, 1] }
)",
                                              "s.toml", ""));
  ASSERT_EQ(world.media.size(), 2u);
  const WorldMedium &plain = world.media[0], &rich = world.media[1];
  EXPECT_EQ(plain.scattering.size(), 1u);
  EXPECT_FALSE(plain.ambient.is_on());
  EXPECT_EQ(rich.scattering.size(), 8u);
  EXPECT_EQ(rich.ambient.at(2), Rgb(0, 0, 0));
  EXPECT_EQ(rich.ambient.at(3), Rgb(0, 0, 0.5));
}

}  // namespace
}  // namespace pileus
