// The march against the exact integrator, ray by ray.
#include <algorithm>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "lib/core/parallel.h"
#include "tests/fixtures/march_scenes.h"
#include "tests/fixtures/picture_scene.h"
#include "tests/fixtures/simd_targets.h"

namespace pileus {
namespace {

const std::string kMarch = "\"march\"", kExact = "\"exact\"";

const MarchScenes& scenes() {
  static const MarchScenes all;
  return all;
}

double difference(const Rgb& a, const Rgb& b) {
  const Rgb d = a - b;
  return std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Transmittance of all media from the start of the ray to t, exactly.
double transmittance_to(const World& world, const Ray& ray, double t) {
  double tau = 0.0;
  for (const WorldMedium& medium : world.media) {
    FieldCounters counters;
    tau += medium.extinction * medium.density->column(ray, {0.0, t}, 1e30, counters);
  }
  return std::exp(-tau);
}

class MarchAgainstExact : public testing::TestWithParam<std::string> {
 protected:
  std::string m_name = GetParam(), m_text = scenes().text_of(m_name);

  /// True errors of a picture; complains about those beyond the tolerance.
  std::vector<double> errors(const std::vector<RayResult>& got, const std::vector<RayResult>& expected,
                             double tolerance, const std::string& what) {
    std::vector<double> all(got.size());
    size_t worst = 0, too_large = 0;
    for (size_t i = 0; i < got.size(); ++i) {
      all[i] = difference(got[i].radiance, expected[i].radiance);
      if (!(all[i] <= tolerance)) ++too_large;
      if (!(all[i] <= all[worst])) worst = i;
    }
    EXPECT_EQ(too_large, 0u) << m_name << ", " << what << ": the worst ray is " << worst
                             << " with an error of " << all[worst] / tolerance
                             << " tolerances: " << got[worst].radiance << " for " << expected[worst].radiance
                             << ", transmittance " << got[worst].transmittance;
    const auto [end, name] = std::pair(what.find('='), what);
    RecordProperty(end == std::string::npos ? name : "worst_at_" + name.substr(end + 2),
                   fmt::format("{:.3g}", all[worst] / tolerance));
    return all;
  }
};

TEST_P(MarchAgainstExact, stays_within_its_tolerance_and_knows_its_error) {
  const PictureScene exact(kExact, m_text, 2e-5);
  const std::vector<RayResult> expected = exact.picture(64);
  for (const double tolerance : {0.03, 0.01, 0.003}) {
    const std::string what = fmt::format("tolerance = {}", tolerance);
    const PictureScene march(kMarch, m_text, tolerance);
    const std::vector<RayResult> got = march.picture(64);
    const std::vector<double> error = errors(got, expected, tolerance, what);
    std::vector<double> reported, true_errors;
    size_t honest = 0, known = 0;
    for (size_t i = 0; i < got.size(); ++i) {
      ASSERT_TRUE(std::isfinite(got[i].error) && got[i].error >= 0.0) << m_name << ", " << i;
      ASSERT_NEAR(got[i].transmittance, expected[i].transmittance, 3.0 * tolerance) << m_name << ", " << i;
      if (expected[i].transmittance > 0.9999999 && error[i] < 1e-9) continue;
      ++known;
      honest += got[i].error + 2e-5 >= error[i];
      // Of a ray that touches a grid for less than a step nothing tells the error.
      EXPECT_LE(error[i], 10.0 * got[i].error + 0.25 * tolerance)
          << m_name << ", " << what << ", ray " << i << ": " << got[i].radiance << " for "
          << expected[i].radiance << ", transmittance " << got[i].transmittance << " for "
          << expected[i].transmittance << ", " << got[i].samples << " samples";
      reported.push_back(got[i].error);
      true_errors.push_back(error[i]);
    }
    if (known == 0) continue;
    // An estimate, no bound: right for nearly all rays of most scenes, for most rays of every scene. Where a
    // haze begins and ends it takes the edge, which errs not at all, for a bend.
    const bool has_haze = m_name.find("haze") != std::string::npos;
    EXPECT_GE(double(honest), (has_haze ? 0.55 : 0.75) * double(known)) << m_name << ", " << what;
    EXPECT_LE(median(reported), 100.0 * median(true_errors) + (has_haze ? 0.6 : 0.1) * tolerance)
        << m_name << ", " << what << ": median error " << median(true_errors);
    RecordProperty(fmt::format("honest_at_{}", tolerance),
                   fmt::format("{:.3f}", double(honest) / double(known)));
    RecordProperty(fmt::format("reported_by_true_at_{}", tolerance),
                   fmt::format("{:.2g}", median(reported) / std::max(median(true_errors), 1e-12)));
  }
}

TEST_P(MarchAgainstExact, depths_are_where_the_medium_is) {
  const std::string with_depth = "aovs = \"beauty, Z\"\n" + m_text;
  const PictureScene exact(kExact, with_depth, 1e-3);
  const std::vector<RayResult> expected = exact.picture(64);
  double voxel = 1e30;
  for (const WorldMedium& medium : exact.world().media) {
    if (medium.density->max_density() > 0.0) voxel = std::min(voxel, medium.density->feature_size());
  }
  for (const double tolerance : {0.03, 0.003}) {
    const PictureScene march(kMarch, with_depth, tolerance);
    const std::vector<RayResult> got = march.picture(64);
    for (size_t i = 0; i < got.size(); ++i) {
      const RayResult &one = got[i], &other = expected[i];
      if (std::isfinite(other.z_first)) {
        // Thin edges may be stepped over, but not what can be seen.
        const double seen = 1.0 - transmittance_to(exact.world(), march.rays()[i], one.z_first);
        EXPECT_GE(one.z_first, other.z_first - 1.5 * voxel) << m_name << ", ray " << i << ", " << tolerance;
        if (one.z_first > other.z_first + 1.5 * voxel) {
          EXPECT_LE(seen, tolerance) << m_name << ", ray " << i << ", " << one.z_first << " for "
                                     << other.z_first;
        }
      } else {
        EXPECT_EQ(one.z_first, other.z_first) << m_name << ", ray " << i;
      }
      if (std::abs(other.transmittance - 0.5) < tolerance) continue;  // may or may not get there
      if (!std::isfinite(other.z_half) || !std::isfinite(one.z_half)) {
        EXPECT_EQ(one.z_half, other.z_half) << m_name << ", ray " << i << ", " << other.transmittance;
      } else if (std::abs(one.z_half - other.z_half) > voxel) {
        EXPECT_NEAR(transmittance_to(exact.world(), march.rays()[i], one.z_half), 0.5, 2.0 * tolerance)
            << m_name << ", ray " << i << ", tolerance " << tolerance << ": " << one.z_half << " for "
            << other.z_half;
      }
    }
  }
}

TEST_P(MarchAgainstExact, threads_and_companions_change_no_bit) {
  const auto same = [&](const std::vector<RayResult>& a, const std::vector<RayResult>& b,
                        const std::string& what) {
    for (size_t i = 0; i < a.size(); ++i) {
      ASSERT_EQ(a[i].radiance, b[i].radiance) << m_name << ", " << what << ", ray " << i;
      ASSERT_EQ(a[i].transmittance, b[i].transmittance) << m_name << ", " << what << ", ray " << i;
      ASSERT_EQ(a[i].z_first, b[i].z_first) << m_name << ", " << what << ", ray " << i;
      ASSERT_EQ(a[i].z_half, b[i].z_half) << m_name << ", " << what << ", ray " << i;
      ASSERT_EQ(a[i].error, b[i].error) << m_name << ", " << what << ", ray " << i;
      ASSERT_EQ(a[i].samples, b[i].samples) << m_name << ", " << what << ", ray " << i;
    }
  };
  std::vector<RayResult> alone;
  with_threads(1, [&] {
    const PictureScene march(kMarch, m_text, 0.01);
    alone = march.picture(16);  // a packet
    for (const size_t group : {48u, 256u})
      same(alone, march.picture(group), fmt::format("groups of {}", group));
    std::vector<Ray> behind;  // the last packets first
    const std::vector<Ray>& rays = march.rays();
    for (size_t end = rays.size(); end > 0; end -= 16) {
      behind.insert(behind.end(), rays.begin() + std::ptrdiff_t(end - 16),
                    rays.begin() + std::ptrdiff_t(end));
    }
    const std::vector<RayResult> traced = march.trace(behind, 32);
    std::vector<RayResult> results;
    for (size_t end = traced.size(); end > 0; end -= 16) {
      results.insert(results.end(), traced.begin() + std::ptrdiff_t(end - 16),
                     traced.begin() + std::ptrdiff_t(end));
    }
    same(alone, results, "backwards");
  });
  for (const int threads : {2, 7}) {
    with_threads(threads, [&] {
      same(alone, PictureScene(kMarch, m_text, 0.01).picture(64), fmt::format("{} threads", threads));
    });
  }
}

TEST_P(MarchAgainstExact, without_its_tricks) {
  const double tolerance = 0.01;
  const std::vector<RayResult> expected = PictureScene(kExact, m_text, 1e-4).picture(64);
  for (const char* options : {"leaping = false", "sun_cache = false", "leaping = false, sun_cache = false",
                              "storage = \"float\"", "storage = \"16-bit\""}) {
    const PictureScene march(fmt::format("{{ type = \"march\", {} }}", options), m_text, tolerance);
    errors(march.picture(64), expected, tolerance, options);
  }
}

TEST_P(MarchAgainstExact, on_every_instruction_set) {
  const double tolerance = 0.01;
  const std::vector<RayResult> expected = PictureScene(kExact, m_text, 1e-4).picture(64);
  for_each_simd_target([&](const std::string& target) {
    errors(PictureScene(kMarch, m_text, tolerance).picture(64), expected, tolerance, target);
  });
}

INSTANTIATE_TEST_SUITE_P(Scenes, MarchAgainstExact, testing::ValuesIn(MarchScenes::names()),
                         [](const auto& test) { return test.param; });

TEST(March, leaves_to_exact_what_it_cannot_do) {
  const std::string grid = MarchScenes::camera() + scenes().grid("blob", "extinction = 3"),
                    sun = MarchScenes::sun(),
                    ball = "[object.ball]\ntype = \"sphere\"\ncenter = [0, 1, 2]\nradius = 0.5\n",
                    lamp = MarchScenes::lamp("lamp", "[0, 4, 2]");
  const std::map<std::string, std::pair<std::string, double>> cases = {
      {"lamp and haze", {grid + MarchScenes::haze("extinction = 0.1\n") + lamp, 0.01}},
      {"tolerance 0", {grid + sun, 0.0}},
      {"no media", {MarchScenes::camera() + ball + sun, 0.01}},
  };
  for (const auto& [name, scene] : cases) {
    const auto& [text, tolerance] = scene;
    const Vec2i size(12, 8);
    const PictureScene march(kMarch, text, tolerance, size), exact(kExact, text, tolerance, size);
    ASSERT_EQ(march.tracer().choices().size(), 1u) << name;
    EXPECT_NE(march.tracer().choices()[0].find("exact"), std::string::npos) << name;
    const std::vector<RayResult> got = march.picture(5), expected = exact.picture(5);
    for (size_t i = 0; i < got.size(); ++i) {
      ASSERT_EQ(got[i].radiance, expected[i].radiance) << name;
      ASSERT_EQ(got[i].transmittance, expected[i].transmittance) << name;
      ASSERT_EQ(got[i].z_half, expected[i].z_half) << name;
    }
  }
}

/// Where kernels cannot tell where they are, rays go to `exact`.
TEST(March, the_lit_skin_of_a_dense_haze_is_found) {
  for (const double extinction : {10.0, 1e2, 1e3, 1e4, 1e8, 1e30}) {
    for (const double tolerance : {0.05, 0.002}) {
      const std::string text =
          MarchScenes::camera("[0, 0, 5]", "[0, 0, 0]") +
          MarchScenes::sun("sun", "[0.6, 0, 0.8]", "[1, 1, 1]") +
          fmt::format(
              "[volume.slab]\ntype = \"box\"\nmin = [-1e3, -1e3, -2]\nmax = [1e3, 1e3, 0]\n"
              "extinction = {}\n",
              extinction);
      const std::vector<RayResult> got = PictureScene(kMarch, text, tolerance, {8, 4}).picture(16),
                                   expected = PictureScene(kExact, text, 1e-6, {8, 4}).picture(16);
      for (size_t i = 0; i < got.size(); ++i) {
        ASSERT_LE(difference(got[i].radiance, expected[i].radiance), tolerance)
            << "extinction " << extinction << ", tolerance " << tolerance << ", ray " << i << ": "
            << got[i].radiance << " for " << expected[i].radiance;
      }
    }
  }
}

TEST(March, extreme_extinctions_give_finite_radiances_within_what_the_light_allows) {
  for (const char* file : {"blob", "random"}) {
    for (const double extinction : {1e-30, 1e-8, 1e2, 1e4, 1e8}) {
      for (const char* more : {"", "multiple_scattering = { octaves = 8 }\npowder = { strength = 1 }"}) {
        const std::string text = MarchScenes::camera() +
                                 scenes().grid(file, fmt::format("extinction = {}\n{}", extinction, more)) +
                                 MarchScenes::sun();
        for (const char* integrator : {"\"march\"", "{ type = \"march\", leaping = false }"}) {
          const PictureScene march(integrator, text, 0.01, {20, 14});
          for (const RayResult& result : march.picture(64)) {
            for (int channel = 0; channel < 3; ++channel) {
              ASSERT_TRUE(std::isfinite(result.radiance[channel])) << text;
              ASSERT_GE(result.radiance[channel], -0.01) << text;
              ASSERT_LE(result.radiance[channel], 2.0 * 9.0 * 0.0796 + 0.01) << text << integrator;
            }
            ASSERT_TRUE(result.transmittance >= 0.0 && result.transmittance <= 1.0) << text;
            ASSERT_TRUE(std::isfinite(result.error)) << text;
          }
        }
      }
    }
  }
}

TEST(March, hands_over_to_exact_what_is_too_dense_for_its_steps) {
  for (const double extinction : {100.0, 1e3, 2e3}) {
    const std::string text = MarchScenes::camera() +
                             scenes().grid("blob", fmt::format("extinction = {}", extinction)) +
                             MarchScenes::sun();
    constexpr double kTolerance = 0.002;
    const PictureScene march(kMarch, text, kTolerance, {20, 14}), exact(kExact, text, 1e-5, {20, 14});
    std::vector<RayResult> got(march.rays().size());
    Counters counters;
    march.tracer().trace(march.rays(), got, counters);
    const std::vector<RayResult> expected = exact.picture(64);
    for (size_t i = 0; i < got.size(); ++i) {
      ASSERT_LE(difference(got[i].radiance, expected[i].radiance), kTolerance) << extinction << ", ray " << i;
    }
    if (extinction > 500.0) {
      EXPECT_GT(counters["exact_rays"], 0u) << "the scene is no test of this";
    }
  }
}

TEST(March, an_empty_grid_is_not_handed_over) {
  const PictureScene march(kMarch,
                           MarchScenes::camera() + MarchScenes::sun() +
                               scenes().grid("nothing", "extinction = 5\nambient = { top = [1, 1, 1] }"),
                           0.01);
  std::vector<RayResult> results(march.rays().size());
  Counters counters;
  march.tracer().trace(march.rays(), results, counters);
  EXPECT_EQ(counters["exact_rays"], 0u);
  for (const RayResult& result : results) EXPECT_EQ(result.transmittance, 1.0);
}

TEST(March, no_rays) {
  const PictureScene march(
      kMarch, MarchScenes::camera() + scenes().grid("blob", "extinction = 3") + MarchScenes::sun(), 0.01);
  Counters counters;
  march.tracer().trace({}, {}, counters);
}

TEST(March, stores_values_as_the_tolerance_allows) {
  const std::string text =
      MarchScenes::camera() + scenes().grid("blob", "extinction = 3") + MarchScenes::sun();
  const auto storage_at = [&](double tolerance, const std::string& integrator = kMarch) {
    const PictureScene march(integrator, text, tolerance);
    for (const std::string& choice : march.tracer().choices()) {
      if (choice.rfind("values of ", 0) == 0) return choice;
    }
    return std::string("nothing said");
  };
  EXPECT_NE(storage_at(0.01).find("in 16 bits"), std::string::npos) << storage_at(0.01);
  EXPECT_NE(storage_at(1e-6).find("as floats: 16 bits would err by"), std::string::npos) << storage_at(1e-6);
  EXPECT_NE(storage_at(1e-6, "{ type = \"march\", storage = \"16-bit\" }").find("in 16 bits"),
            std::string::npos);
  EXPECT_NE(storage_at(0.01, "{ type = \"march\", storage = \"float\" }").find("as floats: asked for"),
            std::string::npos);
}

TEST(March, the_storage_of_values_hardly_changes_a_picture) {
  const std::string text =
      MarchScenes::camera() + scenes().grid("random", "extinction = 6") + MarchScenes::sun();
  for (const double tolerance : {0.01, 0.003}) {
    // Long steps and a coarse cache err alike for both.
    const auto picture = [&](const char* storage) {
      return PictureScene(fmt::format("{{ type = \"march\", storage = \"{}\", sun_cache = false }}", storage),
                          text, tolerance)
          .picture(64);
    };
    const std::vector<RayResult> floats = picture("float"), quantized = picture("16-bit");
    double worst = 0.0;
    for (size_t i = 0; i < floats.size(); ++i)
      worst = std::max(worst, difference(floats[i].radiance, quantized[i].radiance));
    EXPECT_GT(worst, 0.0);
    EXPECT_LE(worst, 0.5 * tolerance) << tolerance;  // a step more or less, here and there
  }
}

TEST(March, a_cloud_that_is_small_in_the_picture) {
  // It falls between the first pilot rays of the sun's cache.
  const Vec3d center(0, 0, -90);
  const std::string text = MarchScenes::camera("[0, 0, 0]", "[0, 0, -90]", 80) +
                           scenes().grid("random", "extinction = 4\ntranslate = [0, 0, -90]") +
                           MarchScenes::sun();
  const Vec2i size(480, 270);
  const PictureScene march(kMarch, text, 0.003, size), exact(kExact, text, 1e-4, size);
  std::vector<Ray> rays;
  for (int n = 0; n < 400; ++n) {
    const Vec3d p = center + 2.0 * Vec3d((n % 20 - 9.5) / 10.0, (n / 20 - 9.5) / 10.0, 0.3);
    rays.push_back({Vec3d(0.0), normalize(p)});
  }
  const std::vector<RayResult> got = march.trace(rays, 64), expected = exact.trace(rays, 64);
  double worst = 0.0;
  for (size_t i = 0; i < got.size(); ++i)
    worst = std::max(worst, difference(got[i].radiance, expected[i].radiance));
  EXPECT_LE(worst, 0.003) << march.tracer().choices()[0];
}

TEST(March, rays_that_miss_or_point_away_bring_the_background) {
  const PictureScene march(kMarch,
                           MarchScenes::camera() + scenes().grid("blob", "extinction = 3") +
                               MarchScenes::sun() +
                               "[background]\ntype = \"constant\"\nradiance = [0.25, 0.5, 1]\n",
                           0.01);
  std::vector<Ray> rays = {{{0, 0, 8}, {0, 0, 1}},
                           {{0, 0, 8}, {0, 1, 0}},
                           {{0, 0, 8}, {-0.0, -1, -0.0}},
                           {{0, 5, 0}, {1, 0, 0}},
                           {{1e6, 1e6, 1e6}, normalize(Vec3d(1))},
                           {{-2.0, 1.7, 1.9}, {0, 0, -1}}};
  for (const RayResult& result : march.trace(rays, 4)) {
    EXPECT_EQ(result.radiance, Rgb(0.25, 0.5, 1.0));
    EXPECT_EQ(result.transmittance, 1.0);
    EXPECT_TRUE(std::isinf(result.z_first));
    EXPECT_TRUE(std::isinf(result.z_half));
    EXPECT_EQ(result.error, 0.0);
  }
}

TEST(March, rays_along_planes_of_the_grid) {
  const std::string text =
      MarchScenes::camera() + scenes().grid("random", "extinction = 2") + MarchScenes::sun();
  const PictureScene march(kMarch, text, 0.005), exact(kExact, text, 1e-5);
  std::vector<Ray> rays;
  for (int n = 0; n < 200; ++n) {
    const double a = 0.25 * (n % 14) - 1.75, b = 0.25 * (n / 14) - 1.75;
    const Vec3d o[] = {{a, b, 8}, {8, a, b}, {a, -8, b}};
    const Vec3d d[] = {{-0.0, 0.0, -1}, {-1, -0.0, 0.0}, {0.0, 1, -0.0}};
    rays.push_back({o[n % 3], d[n % 3]});
    rays.push_back({{a, b, a}, normalize(Vec3d(n % 3 - 1, n % 2 * 2 - 1, n % 5 - 2))});
  }
  const std::vector<RayResult> got = march.trace(rays, 5), expected = exact.trace(rays, 5);
  for (size_t i = 0; i < rays.size(); ++i)
    EXPECT_LE(difference(got[i].radiance, expected[i].radiance), 0.005) << rays[i].o << rays[i].d;
}

}  // namespace
}  // namespace pileus
