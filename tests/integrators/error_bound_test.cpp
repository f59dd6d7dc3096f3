// What is proven about the error of `march` is hunted for counterexamples: each step of the proof by itself,
// then the whole.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "integrators/ray_enclosure.h"
#include "lib/math/transmittance.h"
#include "tests/fixtures/bound_hunt.h"
#include "tests/fixtures/hunt.h"

namespace pileus {
namespace {

constexpr double kAll = std::numeric_limits<double>::infinity();

/// A solid that cannot prove where its shadow lies.
struct UnknownShadow final : Shape {
  std::shared_ptr<const Shape> solid;

  explicit UnknownShadow(std::shared_ptr<const Shape> of) : solid(std::move(of)) { shader = solid->shader; }
  void describe_form(ParamTable&) override {}
  std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment) const override {
    return solid->intersect(ray, segment);
  }
  void append_shadow_edges(const Ray& ray, const Light& light, std::vector<double>& t) const override {
    solid->append_shadow_edges(ray, light, t);
  }
  Box3d bounds() const override { return solid->bounds(); }
};

void add_unknown_shadows(RandomWorld& random) {
  random.add_solids();
  for (auto& shape : random.world.shapes) {
    if (random.chance(0.7)) shape = std::make_shared<UnknownShadow>(shape);
  }
}

/// Solids that mirror, and some of glass.
void add_mirrors(RandomWorld& random) {
  random.add_solids();
  if (random.chance(0.5)) random.add_fog();
  for (const auto& shape : random.world.shapes) {
    std::const_pointer_cast<Shape>(shape)->shader =
        random.chance(0.5) ? make_plugin<SurfaceShader>("glass")
                           : make_plugin<SurfaceShader>("phong", {{"mirror", Vec3d(0.6)}});
  }
  random.plan.reflection = random.plan.refraction = true;
}

void leave_as_it_is(RandomWorld&) {}
void add_fog(RandomWorld& random) {
  random.add_fog();
}
void add_fogs(RandomWorld& random) {
  random.add_fogs();
}
void add_solids(RandomWorld& random) {
  random.add_solids();
}
void add_fog_and_solids(RandomWorld& random) {
  random.add_fog();
  random.add_solids();
}

/// The variation of the derivative of the optical depth along a step is at least what second differences of
/// exact depths show of it.
TEST(ErrorBound, optical_depth_bends_no_more_than_the_curvature_grid_says) {
  std::vector<double> shares;
  for (unsigned seed = 0; seed < 300; ++seed) {
    RandomWorld random(seed);
    if (random.world.lights.empty()) continue;
    const MarchWorld march(random.world, random.plan);
    const EnclosedWorld enclosed(random.world, random.plan, march);
    FieldCounters counters;
    for (int n = 0; n < 60; ++n) {
      const Ray ray = random.ray();
      const double scale = random.world.media[0].density->feature_size();
      const Vec3d middle = ray.at(random.uniform(0.0, 20.0) * scale);
      const Vec3d step = ray.d * (scale * random.logarithmic(0.01, 6.0));
      constexpr int kSteps = 24;
      std::array<double, kSteps + 1> depth;
      for (int i = 0; i <= kSteps; ++i) {
        depth[size_t(i)] = march.exact_depth(0, middle + (double(i) / kSteps - 0.5) * step, counters);
      }
      double variation = 0.0;
      for (size_t i = 1; i < kSteps; ++i) {
        variation += kSteps * std::abs((depth[i + 1] - depth[i]) - (depth[i] - depth[i - 1]));
      }
      const double bound = enclosed.depth_variation(0, middle, step);
      EXPECT_LE(variation, bound + 1e-10 * (1.0 + depth[0])) << "seed " << seed << ", line " << n;
      if (bound > 1e-6 && variation > 1e-6) shares.push_back(variation / bound);
    }
  }
  EXPECT_GT(shares.size(), 1500u);
  // Somewhere the bound is nearly reached, or it would be a poor one.
  EXPECT_GT(*std::max_element(shares.begin(), shares.end()), 0.9);
  std::printf("variation / bound: median %.2f\n", median(shares));
}

/// Integrals of a part against many small Gauss panels.
TEST(ErrorBound, integrals_of_parts_lie_in_their_intervals) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int n = 0; n < 5000; ++n) {
    const double t0 = 3.0 * uniform(random), length = std::pow(10.0, 3.0 * uniform(random) - 2.0);
    std::vector<DensityPiece> pieces(2);
    std::vector<double> extinction;
    for (DensityPiece& piece : pieces) {
      piece.t0 = t0;
      piece.t1 = t0 + length;
      for (double& rho : piece.rho) rho = uniform(random) < 0.2 ? 0.0 : uniform(random);
      extinction.push_back(std::pow(10.0, 4.0 * uniform(random) - 3.0));
    }
    if (n % 3 == 0) pieces[1] = {};
    const double tau0 = uniform(random), a = 4.0 * uniform(random),
                 b = 4.0 * uniform(random) * uniform(random);
    PartIntegrals part;
    part.set(t0, t0 + length, tau0, pieces, extinction);
    double seen = 0.0, slope = 0.0, dimmed = 0.0;
    constexpr int kPanels = 200;
    for (int panel = 0; panel < kPanels; ++panel) {
      for (size_t q = 0; q < GaussLegendre8::kX.size(); ++q) {
        const double u = (panel + GaussLegendre8::kX[q]) / kPanels, t = t0 + u * length;
        double tau = tau0 + extinction[0] * column_to(pieces[0], t);
        if (n % 3 != 0) tau += extinction[1] * column_to(pieces[1], t);
        const double weight =
            GaussLegendre8::kWeight[q] * length / kPanels * transmittance(tau) * density_at(pieces[0], t);
        seen += weight;
        slope += weight * (u - 0.5);
        dimmed += weight * transmittance(a + (b - a) * u);
      }
    }
    const double rounding = 1e-12 * length;
    EXPECT_LE(std::abs(part.seen(0).mid - seen), part.seen(0).half + rounding) << n;
    EXPECT_LE(std::abs(part.seen_slope(0).mid - slope), part.seen_slope(0).half + rounding) << n;
    EXPECT_LE(std::abs(part.seen_dimmed(0, a, b).mid - dimmed), part.seen_dimmed(0, a, b).half + rounding)
        << n;
  }
}

/// Between any two places, fog is what FogOnRay::between() knows of it.
TEST(ErrorBound, fog_stays_within_what_is_known_of_it) {
  size_t bent = 0, coloured = 0;
  for (unsigned seed = 0; seed < 2000; ++seed) {
    RandomWorld random(seed);
    random.add_fog();
    RayView view(random);
    view.look(random.ray());
    const RayFog& fog = view.fog;
    const std::vector<double> edges = fog.edges();
    const double size = random.world.media[0].density->bounds().size().length();
    for (int n = 0; n < 20; ++n) {
      const double t0 = random.uniform(0.0, 3.0) * size, t1 = t0 + random.logarithmic(1e-3, 1.0) * size;
      if (std::any_of(edges.begin(), edges.end(), [&](double t) { return t > t0 && t < t1; })) continue;
      const double depth0 = fog.tau_to(t0), depth1 = fog.tau_to(t1);
      if (!(depth1 < 30.0)) continue;
      const FogRange range = fog.between(t0, t1);
      Veil before = fog.to(t0);
      for (int k = 1; k <= 8; ++k) {
        const double u = k / 8.0, t = t0 + u * (t1 - t0), linear = depth0 + u * (depth1 - depth0);
        EXPECT_LE(std::abs(fog.tau_to(t) - linear), range.bend + 1e-9) << "seed " << seed << ", " << n;
        const Veil veil = fog.to(t);
        const double loss = before.transmittance - veil.transmittance;
        EXPECT_GE(loss, -1e-12);
        for (int c = 0; c < 3; ++c) {
          const double gain = veil.light[c] - before.light[c];
          EXPECT_GE(gain, range.least[c] * loss - 1e-9) << "seed " << seed << ", " << n;
          EXPECT_LE(gain, range.most[c] * loss + 1e-9) << "seed " << seed << ", " << n;
        }
        before = veil;
      }
      bent += range.bend > 1e-3;
      coloured += range.most.x > range.least.x * 1.01;
    }
  }
  EXPECT_GT(bent, 2000u);
  EXPECT_GT(coloured, 1000u);
}

/// What a solid says that it shades, no ray contradicts.
TEST(ErrorBound, solids_shade_what_they_say) {
  std::array<size_t, 3> said{};
  for (unsigned seed = 0; seed < 300; ++seed) {
    RandomWorld random(seed);
    random.add_solids();
    const double size = random.world.media[0].density->bounds().size().length();
    const Vec3d wi = random.direction();
    for (const auto& shape : random.world.shapes) {
      for (int n = 0; n < 40; ++n) {
        const Ray ray = random.ray();
        const double t = random.uniform(0.0, 1.0) * size, step = random.logarithmic(1e-3, 0.3) * size;
        const auto& known = dynamic_cast<const KnownShadow&>(*shape);
        const Shade shade = known.shade_between(ray.at(t), ray.at(t + step), wi, 1e-12);
        ++said[size_t(shade)];
        for (int k = 0; k <= 8 && shade != Shade::unknown; ++k) {
          const Ray shadow{ray.at(t + step * k / 8.0), wi};
          EXPECT_EQ(shape->intersect(shadow, {0.0, kAll}).has_value(), shade == Shade::all)
              << "seed " << seed << ", " << n;
        }
      }
    }
  }
  for (const size_t count : said) EXPECT_GT(count, 200u);
}

/// The light of overlapping fogs grows within the ranges that are told, and these become narrow.
TEST(ErrorBound, light_of_fogs_grows_as_told) {
  size_t several = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    RandomWorld random(seed);
    random.add_fogs();
    RayView view(random);
    view.look(random.ray());
    if (view.fog.has_closed_form()) continue;
    const double size = random.world.media[0].density->bounds().size().length();
    FogLight coarse, fine;
    coarse.build(&view.fog, kAll);
    fine.build(&view.fog, 1e-7);
    for (const double share : {0.1, 0.5, 0.7, 1.3, 2.0, kAll}) {
      const Rgb light = view.fog.to(share * size).light;
      for (FogLight* enclosed : {&coarse, &fine}) {
        const EnclosedRgb range = enclosed->at(share * size);
        for (int c = 0; c < 3; ++c)
          EXPECT_LE(std::abs(range.mid[c] - light[c]), range.half[c] + 1e-6) << "seed " << seed;
      }
      EXPECT_LT(largest(fine.at(share * size).half), 1e-3) << "seed " << seed;
      ++several;
    }
  }
  EXPECT_GT(several, 500u);
}

TEST(ErrorBound, exact_radiance_lies_in_every_interval) {
  expect_radiance_in_every_interval(1000, size_t(hunted(80)), leave_as_it_is);
}

TEST(ErrorBound, exact_radiance_through_fog_lies_in_every_interval) {
  expect_radiance_in_every_interval(2000, size_t(hunted(60)), add_fog);
}

TEST(ErrorBound, exact_radiance_through_several_fogs_lies_in_every_interval) {
  expect_radiance_in_every_interval(4000, size_t(hunted(8)), add_fogs);
}

TEST(ErrorBound, exact_radiance_among_solids_lies_in_every_interval) {
  expect_radiance_in_every_interval(3000, size_t(hunted(60)), add_solids);
}

TEST(ErrorBound, exact_radiance_in_shadows_of_which_nothing_is_known_lies_in_every_interval) {
  expect_radiance_in_every_interval(9000, size_t(hunted(40)), add_unknown_shadows);
}

TEST(ErrorBound, no_ray_errs_by_more) {
  const std::vector<double> ratios = expect_no_ray_errs_by_more(5100, size_t(hunted(40)), leave_as_it_is);
  EXPECT_GT(ratios.size(), 400u);
  EXPECT_LT(median(ratios), 3.0);
}

TEST(ErrorBound, no_ray_errs_by_more_through_fog) {
  const std::vector<double> ratios = expect_no_ray_errs_by_more(6000, size_t(hunted(40)), add_fog);
  EXPECT_GT(ratios.size(), 300u);
  EXPECT_LT(median(ratios), 3.0);
}

TEST(ErrorBound, no_ray_errs_by_more_among_solids_in_fog) {
  const std::vector<double> ratios = expect_no_ray_errs_by_more(7000, size_t(hunted(20)), add_fog_and_solids);
  EXPECT_GT(ratios.size(), 150u);
  EXPECT_LT(median(ratios), 4.0);
}

/// Mirrors and glass, of which rays see each other: what one ray errs the next one shows.
TEST(ErrorBound, no_ray_errs_by_more_among_mirrors) {
  const std::vector<double> ratios = expect_no_ray_errs_by_more(8000, size_t(hunted(30)), add_mirrors);
  EXPECT_GT(ratios.size(), 200u);
  EXPECT_LT(median(ratios), 6.0);
}

TEST(ErrorBound, a_ray_that_meets_nothing_has_no_error) {
  RandomWorld random(1);
  const auto march = prepared("march", random, 0.01);
  const Box3d box = random.world.media[0].density->bounds();
  const Ray away{box.max + Vec3d(100.0), normalize(Vec3d(1.0))};
  EXPECT_EQ(trace(*march, {&away, 1})[0].bound, 0.0);
}

TEST(ErrorBound, who_does_not_ask_gets_none) {
  RandomWorld random(1);
  random.plan.aovs = {"beauty"};
  const Ray ray = random.ray();
  EXPECT_TRUE(std::isnan(trace(*prepared("march", random, 0.01), {&ray, 1})[0].bound));
}

}  // namespace
}  // namespace pileus
