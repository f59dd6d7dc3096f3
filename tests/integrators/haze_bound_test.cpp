// The error bound of `march` through hazes: each step of the proof is hunted for counterexamples, then the
// whole.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "integrators/part_integrals.h"
#include "lib/math/transmittance.h"
#include "tests/fixtures/bound_hunt.h"
#include "tests/fixtures/hunt.h"

namespace pileus {
namespace {

void add_hazes(RandomWorld& random) {
  random.add_hazes();
}
void add_hazes_and_fog(RandomWorld& random) {
  random.add_hazes();
  random.add_fog();
}
void add_hazes_and_solids(RandomWorld& random) {
  random.add_hazes();
  random.add_solids();
}

/// A cubic, or an exponential that rises or falls by up to e^6.
DensityPiece random_piece(RandomWorld& random, double t0, double length) {
  DensityPiece piece{t0, t0 + length};
  for (double& rho : piece.rho) rho = random.chance(0.2) ? 0.0 : random.uniform(0.0, 1.0);
  if (random.chance(0.3)) return piece;
  piece.rate = random.sign() * random.logarithmic(0.01, 6.0) / length;
  piece.rho.fill(random.logarithmic(0.01, 1.0) * std::exp(-std::max(0.0, piece.rate * length)));
  return piece;
}

/// Integrals of a part against many small Gauss panels.
TEST(HazeBound, integrals_of_exponentials_lie_in_their_intervals) {
  RandomWorld random(1);
  size_t narrow = 0;
  const int count = hunted(5000);
  for (int n = 0; n < count; ++n) {
    const double t0 = random.uniform(0.0, 3.0), length = random.logarithmic(0.01, 10.0);
    std::vector<DensityPiece> pieces{random_piece(random, t0, length), random_piece(random, t0, length)};
    const std::vector<double> extinction{random.logarithmic(1e-3, 10.0), random.logarithmic(1e-3, 10.0)};
    if (n % 3 == 0) pieces[1] = {};
    const double tau0 = random.uniform(0.0, 1.0), a = random.uniform(0.0, 4.0),
                 b = a + random.sign() * random.logarithmic(0.001, 1.0) * a;
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
    const Enclosed in_light = part.seen_dimmed(0, a, b);
    EXPECT_LE(std::abs(part.seen(0).mid - seen), part.seen(0).half + rounding) << n;
    EXPECT_LE(std::abs(part.seen_slope(0).mid - slope), part.seen_slope(0).half + rounding) << n;
    EXPECT_LE(std::abs(in_light.mid - dimmed), in_light.half + rounding) << n;
    narrow += in_light.half < 1e-4 * in_light.mid;
  }
  EXPECT_GT(narrow, size_t(count / 2));
}

TEST(HazeBound, exact_radiance_lies_in_every_interval) {
  expect_radiance_in_every_interval(11000, size_t(hunted(80)), add_hazes);
}

TEST(HazeBound, exact_radiance_through_fog_lies_in_every_interval) {
  expect_radiance_in_every_interval(12000, size_t(hunted(30)), add_hazes_and_fog);
}

TEST(HazeBound, exact_radiance_among_solids_lies_in_every_interval) {
  expect_radiance_in_every_interval(13000, size_t(hunted(40)), add_hazes_and_solids);
}

TEST(HazeBound, no_ray_errs_by_more) {
  const std::vector<double> ratios = expect_no_ray_errs_by_more(14000, size_t(hunted(40)), add_hazes);
  EXPECT_GT(ratios.size(), 300u);
  EXPECT_LT(median(ratios), 10.0);
}

TEST(HazeBound, no_ray_errs_by_more_among_solids) {
  const std::vector<double> ratios =
      expect_no_ray_errs_by_more(15000, size_t(hunted(20)), add_hazes_and_solids);
  EXPECT_GT(ratios.size(), 150u);
  EXPECT_LT(median(ratios), 6.0);
}

/// A haze of which nobody knows how its columns bend.
struct StrangeHaze final : DensityField {
  std::shared_ptr<const DensityField> haze = make_box_field({{-1, -1, -1}, {1, 1, 1}});

  Box3d bounds() const override { return haze->bounds(); }
  double max_density() const override { return haze->max_density(); }
  double feature_size() const override { return haze->feature_size(); }
  void append_pieces(const Ray& ray, Segment segment, std::vector<DensityPiece>& pieces,
                     FieldCounters& counters) const override {
    haze->append_pieces(ray, segment, pieces, counters);
  }
  double column(const Ray& ray, Segment segment, double enough, FieldCounters& counters) const override {
    return haze->column(ray, segment, enough, counters);
  }
  void sample(const Ray& ray, double t0, double dt, std::span<double> rho,
              FieldCounters& counters) const override {
    haze->sample(ray, t0, dt, rho, counters);
  }
};

TEST(HazeBound, is_refused_where_columns_are_not_known) {
  RandomWorld random(1);
  random.world.media[0].density = std::make_shared<StrangeHaze>();
  const auto march = prepared("march", random, 0.01);
  EXPECT_NE(march->choices().at(0).find("no bound is known"), std::string::npos) << march->choices().at(0);
  const Ray ray = random.ray();
  EXPECT_TRUE(std::isnan(trace(*march, {&ray, 1})[0].bound));
  random.plan.aovs = {"beauty"};
  EXPECT_NE(prepared("march", random, 0.01)->choices().at(0).find("sunlight"), std::string::npos);
}

}  // namespace
}  // namespace pileus
