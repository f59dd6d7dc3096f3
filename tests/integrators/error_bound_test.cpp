// What is proven about the error of `march` is hunted for counterexamples: each step of the proof by itself,
// then the whole.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "integrators/ray_enclosure.h"
#include "lib/core/parallel.h"
#include "lib/math/gauss_kronrod.h"
#include "lib/math/transmittance.h"
#include "tests/fixtures/hunt.h"
#include "tests/fixtures/random_world.h"

namespace pileus {
namespace {

constexpr double kAll = std::numeric_limits<double>::infinity();

double largest(const Rgb& rgb) {
  return std::max({std::abs(rgb.x), std::abs(rgb.y), std::abs(rgb.z)});
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

std::unique_ptr<const Tracer> tracer(const char* name, const RandomWorld& random, double tolerance) {
  const auto integrator =
      std::dynamic_pointer_cast<Integrator>(plugin_registry().find(Integrator::kKind, name)->make());
  Accuracy accuracy{tolerance, 1.0, {64, 64}};
  accuracy.most_bounces = 3;
  return integrator->prepare(random.world, random.plan, accuracy);
}

std::vector<RayResult> trace(const Tracer& tracer, std::span<const Ray> rays) {
  std::vector<RayResult> results(rays.size());
  Counters counters;
  tracer.trace(rays, results, counters);
  return results;
}

/// The radiance of a ray by brute force: every span of every medium in panels of its own, halved until the
/// rules of 3 and 7 points agree. Slower than `exact` and less trusting: `exact` takes some panels across
/// several spans, and its estimate is no proof.
class CarefulRadiance {
 public:
  CarefulRadiance(const RandomWorld& random, const MarchWorld& march)
      : m_world(random.world), m_march(march) {}

  ///   behind: what arrives from the end of the segment, through the fog
  ///   fog: of the ray; null: none
  Rgb trace(const Ray& ray, Segment segment, const Rgb& behind, const RayFog* fog) {
    m_ray = ray;
    m_fog = fog;
    std::vector<double> cuts = fog ? fog->edges() : std::vector<double>{};
    for (const auto& shape : m_world.shapes) {
      for (const auto& light : m_world.lights) shape->append_shadow_edges(ray, *light, cuts);
    }
    std::erase_if(cuts, [&](double t) { return !(t > segment.t0 && t < segment.t1); });
    m_profile.build(m_world, ray, segment, cuts, m_counters);
    Rgb sum = transmittance(m_profile.tau()) * behind;
    constexpr int kPanels = 4;
    for (size_t i = 0; i < m_profile.spans().size(); ++i) {
      const RayProfile::Span& span = m_profile.spans()[i];
      if (span.tau0 > 40.0) break;
      const double h = (span.t1 - span.t0) / kPanels;
      for (int n = 0; n < kPanels; ++n) sum += integral(i, span.t0 + n * h, span.t0 + (n + 1) * h, 24);
    }
    return sum;
  }

 private:
  Rgb integral(size_t span, double t0, double t1, int halvings) {
    Rgb seven(0.0), three(0.0);
    for (const auto& node : GaussKronrod7::kNodes) {
      const Rgb value = (t1 - t0) * integrand(span, t0 + node.x * (t1 - t0));
      seven += node.kronrod * value;
      three += node.gauss * value;
    }
    if (halvings == 0 || largest(seven - three) <= 1e-8) return seven;
    const double t = 0.5 * (t0 + t1);
    return integral(span, t0, t, halvings - 1) + integral(span, t, t1, halvings - 1);
  }

  Rgb integrand(size_t span, double t) {
    const Vec3d p = m_ray.at(t);
    const double passed = transmittance(m_profile.spans()[span].tau0 + m_profile.tau_to(span, t));
    if (passed < 1e-14) return Rgb(0.0);
    Rgb sum(0.0);
    for (size_t m = 0; m < m_world.media.size(); ++m) {
      const WorldMedium& medium = m_world.media[m];
      Rgb source = medium.ambient.at(p.y);
      for (size_t l = 0; l < m_march.suns().size(); ++l) {
        const Illumination& sun = m_march.suns()[l];
        if (is_occluded(m_world, {p, sun.wi}, {0.0, kAll})) continue;
        const double phase = medium.phase->p(-m_ray.d, sun.wi);
        source += sun.irradiance *
                  scatter_response(medium.scattering, phase, m_march.exact_depth(l, p, m_counters));
      }
      const Veil veil = m_fog ? m_fog->to(t) : Veil{};
      const Rgb light = medium.emission + medium.extinction * medium.albedo * source;
      sum += m_profile.density(span, m, t) * (veil.transmittance * light + medium.extinction * veil.light);
    }
    return passed * sum;
  }

  const World& m_world;
  const MarchWorld& m_march;
  Ray m_ray;
  const RayFog* m_fog = nullptr;
  RayProfile m_profile;
  FieldCounters m_counters;
};

/// A ray up to where it ends, what it is said to see there, and the fog that it brings along.
struct RayView {
  explicit RayView(const RandomWorld& random) : setup(random.world, 1e-5, {}), fog(setup), m_random(random) {}

  void look(const Ray& ray) {
    const auto hit = nearest_surface(m_random.world, ray, {0.0, kAll});
    segment = {0.0, hit ? hit->t : kAll};
    behind = m_random.world.background->radiance(ray.d);
    if (!m_random.plan.fog) return;
    fog.build(ray, segment.t1, true);
    behind = fog.end().over(behind);
  }
  const RayFog* fog_if_any() const { return m_random.plan.fog ? &fog : nullptr; }

  FogSetup setup;
  RayFog fog;
  Segment segment;
  Rgb behind;

 private:
  const RandomWorld& m_random;
};

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

using Furnish = void (*)(RandomWorld&);

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

/// However coarse or fine, an interval holds the radiance.
void expect_radiance_in_every_interval(unsigned first_seed, size_t worlds, Furnish furnish) {
  constexpr int kRays = 30;
  parallel_for(worlds, [&](size_t seed) {
    RandomWorld random(unsigned(first_seed + seed));
    furnish(random);
    const MarchWorld march(random.world, random.plan);
    const EnclosedWorld enclosed(random.world, random.plan, march);
    RayEnclosure enclosure(enclosed);
    CarefulRadiance careful(random, march);
    RayView view(random);
    for (int n = 0; n < kRays; ++n) {
      const Ray ray = random.ray();
      view.look(ray);
      const Rgb truth = careful.trace(ray, view.segment, view.behind, view.fog_if_any());
      for (const double goal : {kAll, 1e-1, 1e-2, 1e-3, 1e-4}) {
        const EnclosedRgb interval = enclosure.enclose(ray, view.segment, {view.behind, Rgb(0.0)}, truth,
                                                       {goal, 0.0, 2000}, view.fog_if_any());
        for (int c = 0; c < 3; ++c) {
          EXPECT_LE(std::abs(interval.mid[c] - truth[c]), interval.half[c] + 1e-7)
              << "world " << seed << ", ray " << n << ", goal " << goal;
        }
      }
    }
  });
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

/// 60 rays in each world: no channel of any ray errs by more than its bound, whoever says what is right.
/// Returns bound / error of those that have an error.
std::vector<double> expect_no_ray_errs_by_more(unsigned first_seed, size_t worlds, Furnish furnish) {
  constexpr size_t kRays = 60;
  std::vector<std::vector<double>> ratios(worlds);
  parallel_for(worlds, [&](size_t seed) {
    RandomWorld random(unsigned(first_seed + seed));
    furnish(random);
    const MarchWorld world(random.world, random.plan);
    CarefulRadiance careful(random, world);
    RayView view(random);
    const auto exact = tracer("exact", random, 1e-8);
    const auto march = tracer("march", random, random.logarithmic(1e-4, 0.3));
    std::vector<Ray> rays;
    for (size_t n = 0; n < kRays; ++n) rays.push_back(random.ray());
    const std::vector<RayResult> exactly = trace(*exact, rays), marched = trace(*march, rays);
    for (size_t n = 0; n < kRays; ++n) {
      view.look(rays[n]);
      const bool has_end = std::isfinite(view.segment.t1);  // what is seen there, `exact` has to say
      const Rgb truth = has_end ? exactly[n].radiance
                                : careful.trace(rays[n], view.segment, view.behind, view.fog_if_any());
      const double error = largest(marched[n].radiance - truth), doubt = has_end ? exactly[n].error : 0.0;
      EXPECT_LE(error, marched[n].bound + doubt + 1e-7) << "world " << seed << ", ray " << n;
      EXPECT_LE(largest(marched[n].radiance - exactly[n].radiance),
                marched[n].bound + exactly[n].error + 1e-7)
          << "world " << seed << ", ray " << n;
      if (error > 1e-6) ratios[seed].push_back(marched[n].bound / error);
    }
  });
  std::vector<double> all;
  for (const auto& some : ratios) all.insert(all.end(), some.begin(), some.end());
  std::printf("bound / error: median %.2f, largest %.0f, of %zu rays with an error\n", median(all),
              *std::max_element(all.begin(), all.end()), all.size());
  return all;
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
  const auto march = tracer("march", random, 0.01);
  const Box3d box = random.world.media[0].density->bounds();
  const Ray away{box.max + Vec3d(100.0), normalize(Vec3d(1.0))};
  EXPECT_EQ(trace(*march, {&away, 1})[0].bound, 0.0);
}

TEST(ErrorBound, who_does_not_ask_gets_none) {
  RandomWorld random(1);
  random.plan.aovs = {"beauty"};
  const Ray ray = random.ray();
  EXPECT_TRUE(std::isnan(trace(*tracer("march", random, 0.01), {&ray, 1})[0].bound));
}

}  // namespace
}  // namespace pileus
