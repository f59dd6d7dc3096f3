// The fogs of scenes against the forms that their manual pages tell.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/fog/fade.h"
#include "lib/fog/fog_on_ray.h"
#include "lib/fog/lit_layer.h"
#include "lib/math/gauss_kronrod.h"
#include "tests/fixtures/hunt.h"
#include "tests/fixtures/traced_scene.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The fogs of a scene, with a camera at (0, 0, 5) that looks along -z.
class Fogs {
 public:
  explicit Fogs(const std::string& text) : m_scene(text) {}

  FogOnRay along(const Ray& ray, double accuracy = 1e-10) const {
    FogOnRay fog;
    std::vector<FogPiece>& pieces = fog.start();
    for (const WorldFog& each : m_scene.world().fogs) each.model->append_pieces(ray, each.view, pieces);
    fog.finish(kInfinity, accuracy);
    return fog;
  }

 private:
  TracedScene m_scene;
};

Vec3d towards(double x, double y, double z) {
  return normalize(Vec3d(x, y, z));
}

void expect_near(const Rgb& got, const Rgb& expected, double tolerance) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[c], expected[c], tolerance) << "channel " << c;
}

const Vec3d kEye(0.0, 0.0, 5.0);
const std::string kSun = "[light.sun]\ntype = \"sun\"\ndirection = [0, 1, 1]\nirradiance = [3, 2, 1]\n";

TEST(DistanceFog, fades_as_the_classical_factors_do) {
  const std::string colour = "colour = [0.2, 0.4, 0.6]\nstart = 10\n";
  const Fogs linear("[fog.f]\ntype = \"distance\"\nlaw = \"linear\"\nend = 110\n" + colour);
  const Fogs exponential("[fog.f]\ntype = \"distance\"\ndensity = 0.02\n" + colour);
  const Fogs squared("[fog.f]\ntype = \"distance\"\nlaw = \"exponential_squared\"\ndensity = 0.02\n" +
                     colour);
  const Ray ray{kEye, towards(0.3, 0.2, -1.0)};
  for (const double d : {0.0, 5.0, 10.0, 40.0, 109.0, 111.0, 500.0}) {
    const double beyond = std::max(d - 10.0, 0.0);
    const auto check = [&](const Fogs& fogs, double fade) {
      const Veil veil = fogs.along(ray).to(d);
      EXPECT_NEAR(veil.transmittance, fade, 1e-14) << d;
      expect_near(veil.light, (1.0 - fade) * Rgb(0.2, 0.4, 0.6), 1e-14);
    };
    check(linear, linear_fade(d, 10.0, 110.0));
    check(exponential, exponential_fade(beyond, 0.02));
    check(squared, exponential_squared_fade(beyond, 0.02));
  }
}

TEST(DistanceFog, planar_distance_is_that_along_the_view_axis) {
  const Fogs planar("[fog.f]\ntype = \"distance\"\ndensity = 0.02\nmeasure = \"planar\"\n");
  const Vec3d d = towards(1.0, 0.0, -1.0);
  EXPECT_NEAR(planar.along({kEye, d}).to(100.0).transmittance, std::exp(-2.0 * -d.z), 1e-15);
  EXPECT_EQ(planar.along({kEye, {1.0, 0.0, 0.0}}).to(1e9).transmittance, 1.0);
  EXPECT_EQ(planar.along({kEye, {0.0, 0.0, 1.0}}).to(1e9).transmittance, 1.0);
}

TEST(DistanceFog, a_linear_fog_without_depth_is_a_step) {
  const Fogs step("[fog.f]\ntype = \"distance\"\nlaw = \"linear\"\nstart = 10\nend = 10\n");
  const FogOnRay fog = step.along({kEye, {0.0, 0.0, -1.0}});
  EXPECT_EQ(fog.to(9.999).transmittance, 1.0);
  EXPECT_EQ(fog.to(10.0).transmittance, 0.0);
  EXPECT_EQ(fog.to(10.001).transmittance, 0.0);
}

TEST(HeightFog, is_whole_below_its_base_and_thins_out_above) {
  const Fogs fogs("[fog.f]\ntype = \"height\"\nbase = -20\nscale_height = 30\nextinction = 0.01\n");
  for (const Vec3d& d : {towards(0, -1, -0.2), towards(0, 1, -0.2), towards(0, -1e-9, -1), Vec3d(0, 0, -1)}) {
    for (const double from : {0.0, -50.0, -20.0}) {
      const Ray ray{{0.0, from, 0.0}, d};
      double tau = 0.0;
      const int steps = 100000;
      for (int i = 0; i < steps; ++i) {
        const double y = ray.at((i + 0.5) * 200.0 / steps).y;
        tau += 0.01 * std::min(1.0, std::exp(-(y + 20.0) / 30.0)) * 200.0 / steps;
      }
      EXPECT_NEAR(fogs.along(ray).tau_to(200.0), tau, 1e-7) << d << " from " << from;
    }
  }
}

/// The slow twin of closed forms: panels between all `cuts` of [0, end], each in `parts`.
double integral(const std::function<double(double)>& f, double end, std::vector<double> cuts,
                int parts = 24) {
  cuts.insert(cuts.end(), {0.0, end});
  std::erase_if(cuts, [&](double t) { return !(t >= 0.0 && t <= end); });
  std::sort(cuts.begin(), cuts.end());
  double sum = 0.0;
  for (size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double h = (cuts[i + 1] - cuts[i]) / parts;
    for (int part = 0; part < parts; ++part) {
      for (const auto& node : GaussKronrod7::kNodes)
        sum += h * node.kronrod * f(cuts[i] + h * (part + node.x));
    }
  }
  return sum;
}

/// Views that are hard on closed forms: level, nearly level, straight up and down, any.
class HardViews {
 public:
  /// From below a layer that ends at `top`, from in it, and from far above.
  Ray next(double top) {
    const double rises[] = {0.0, 1e-300, -1e-300, 1e-14, -1e-14, 1e-7, -1e-7, 1.0, -1.0, any(), any(), any()};
    const double heights[] = {-3.0 * top, 0.0, 1e-9 * top, 0.5 * top, top, 1.5 * top, 40.0 * top};
    const double rise = rises[m_rng() % std::size(rises)];
    return {{0.0, heights[m_rng() % std::size(heights)], 0.0},
            {std::sqrt((1.0 - rise) * (1.0 + rise)), rise, 0.0}};
  }
  double power_of_ten(double least, double most) {
    return std::pow(10.0, std::uniform_real_distribution<double>(least, most)(m_rng));
  }

 private:
  double any() { return std::uniform_real_distribution<double>(-1.0, 1.0)(m_rng); }

  std::mt19937_64 m_rng{11};
};

TEST(HeightFog, agrees_with_a_slow_integral_from_every_view) {
  HardViews views;
  for (int i = 0; i < hunted(400); ++i) {
    // Down to fog that is not there and to fog without a height.
    const double extinction = views.power_of_ten(-12, 2), scale = views.power_of_ten(-9, 4);
    const Ray ray = views.next(scale);
    const Fogs fogs(fmt::format(
        "[fog.f]\ntype = \"height\"\nextinction = {:.17g}\nscale_height = {:.17g}\ncolour = [1, 1, 1]\n",
        extinction, scale));
    const double end = scale * views.power_of_ten(-2, 3);
    // Cuts where the height passes multiples of the scale height.
    std::vector<double> cuts;
    for (const double z : {0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0})
      cuts.push_back((z * scale - ray.o.y) / ray.d.y);
    const double tau = integral(
        [&](double t) { return extinction * std::exp(-std::max(ray.o.y + t * ray.d.y, 0.0) / scale); }, end,
        cuts);
    const FogOnRay fog = fogs.along(ray);
    EXPECT_NEAR(fog.tau_to(end), tau, 1e-9 * tau)
        << extinction << " " << scale << " " << ray.o << ray.d << end;
    EXPECT_NEAR(fog.to(end).light.x, -std::expm1(-tau), 1e-9 * std::min(tau, 1.0))
        << extinction << " " << scale;
  }
}

TEST(SunlitLayer, agrees_with_a_slow_integral_from_every_view) {
  HardViews views;
  for (int i = 0; i < hunted(400); ++i) {
    const double extinction = views.power_of_ten(-12, 2), thickness = views.power_of_ten(-9, 4),
                 sine = views.power_of_ten(-3, 0);
    const Ray ray = views.next(thickness);
    const Fogs fogs(fmt::format(
        "[fog.f]\ntype = \"sunlit_layer\"\nextinction = {:.17g}\nthickness = {:.17g}\nsun = \"sun\"\n"
        "[light.sun]\ntype = \"sun\"\ndirection = [0, {:.17g}, {:.17g}]\nirradiance = [1, 1, 1]\n",
        extinction, thickness, sine, std::sqrt((1.0 - sine) * (1.0 + sine))));
    const double end = thickness * views.power_of_ten(-2, 3);
    std::vector<double> cuts{-ray.o.y / ray.d.y, (thickness - ray.o.y) / ray.d.y};
    const double enters = ray.o.y >= 0.0 && ray.o.y <= thickness ? 0.0 : std::min(cuts[0], cuts[1]);
    // Both ways dim within a mean free path, along the view and up to the sun.
    for (const double free_paths : {0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 40.0}) {
      const double s = free_paths / extinction;
      cuts.insert(cuts.end(),
                  {enters + s, enters + s * sine, cuts[0] - s * sine / ray.d.y, cuts[1] - s * sine / ray.d.y,
                   cuts[0] + s * sine / ray.d.y, cuts[1] + s * sine / ray.d.y});
    }
    const auto lit = [&](double t) {
      // Depths from the top, which rays that begin there leave by less than rounding.
      const double depth = (thickness - ray.o.y) - t * ray.d.y;
      if (!(depth > 0.0 && ray.o.y + t * ray.d.y > 0.0)) return 0.0;
      return extinction * std::exp(-extinction * (t - enters) - extinction * depth / sine) /
             (4.0 * std::numbers::pi);
    };
    const double light = integral(lit, end, cuts);
    EXPECT_NEAR(fogs.along(ray).to(end).light.x, light, 1e-7 * light + 1e-14)
        << extinction << " " << thickness << " " << sine << " " << ray.o << ray.d << end;
  }
}

TEST(LayerFog, exact_form_is_the_integral_in_any_direction) {
  const std::string layer =
      "[fog.f]\ntype = \"layer\"\ncenter = [0, 10, 0]\nradii = [40, 10, 30]\nextinction = 0.02\n"
      "extinction_top = 0.2\ncolour = [0.1, 0.2, 0.9]\ncolour_top = [0.9, 0.8, 0.3]\n";
  const Fogs exact(layer), legacy(layer + "form = \"legacy\"\n");
  for (const Vec3d& d : {towards(0, 1, 0.1), towards(0.2, -1, 0), towards(1, 0.01, 0.3), Vec3d(1, 0, 0)}) {
    const Ray ray{Vec3d(2.0, 9.0, 1.0) - 100.0 * d, d};
    const auto share = [](double u) {
      return (0.02 + 0.09 * u) * u / 0.11;
    };  // of the depth, from the bottom
    double tau = 0.0;
    Rgb light(0.0);
    const int steps = 200000;
    for (int i = 0; i < steps; ++i) {
      const double h = 200.0 / steps;
      const Vec3d p = ray.at((i + 0.5) * h), q = (p - Vec3d(0, 10, 0)) / Vec3d(40, 10, 30);
      if (q.length2() > 1.0) continue;
      const double u = 0.5 + 0.5 * q.y, sigma = 0.02 + 0.18 * u;
      light += (Rgb(0.1, 0.2, 0.9) + Rgb(0.8, 0.6, -0.6) * share(u)) *
               (sigma * h * std::exp(-tau - 0.5 * sigma * h));
      tau += sigma * h;
    }
    const Veil veil = exact.along(ray).to(200.0);
    EXPECT_NEAR(veil.transmittance, std::exp(-tau), 1e-4) << d;
    expect_near(veil.light, light, 1e-3);
    EXPECT_EQ(legacy.along(ray).to(200.0).transmittance, veil.transmittance);
  }
}

TEST(LayerFog, legacy_form_takes_half_the_sum_of_both_colours) {
  const std::string layer =
      "[fog.f]\ntype = \"layer\"\ncenter = [0, 10, 0]\nradii = [10, 10, 10]\nextinction = 0.25\n"
      "extinction_top = 0.25\ncolour = [0, 0, 0]\ncolour_top = [1, 1, 1]\n";
  const Ray up{{0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}};
  // tau = 5: METHODS 2.2 has 0.4966 and 0.1919.
  EXPECT_NEAR(Fogs(layer).along(up).to(20.0).light.x, 0.1919, 5e-5);
  EXPECT_NEAR(Fogs(layer + "form = \"legacy\"\n").along(up).to(20.0).light.x, 0.4966, 5e-5);
}

TEST(SunlitLayer, shows_the_exact_form_and_the_legacy_one_by_name) {
  const std::string layer =
      "[fog.f]\ntype = \"sunlit_layer\"\nthickness = 100\nextinction = 0.01\nsun = \"sun\"\nalbedo = [1, "
      "0.5, 0]\n" +
      kSun;
  const double sun = std::numbers::sqrt2 / 2.0, depression = 0.5;
  const Ray down{{0.0, 20.0, 0.0}, {0.0, -depression, -std::sqrt(0.75)}};
  const double per_metre = 0.01 / (4.0 * std::numbers::pi);  // S of the red channel
  const double exact = lit_layer_light(0.01, 100.0, 20.0, depression, sun),
               legacy = legacy_lit_layer_light(0.01, 100.0, 20.0, depression, sun);
  expect_near(Fogs(layer).along(down).to(1e9).light, Rgb(3.0, 1.0, 0.0) * (per_metre * exact), 1e-15);
  const Fogs old(
      "[fog.f]\ntype = \"sunlit_layer\"\nthickness = 100\nextinction = 0.01\nsun = \"sun\"\nform = "
      "\"legacy\"\n" +
      kSun);
  EXPECT_NEAR(old.along(down).to(1e9).light.x, 3.0 * per_metre * legacy, 1e-15);
}

TEST(SunlitLayer, is_dark_where_the_sun_is_down_and_has_no_edge_at_the_horizon) {
  const std::string layer = "[fog.f]\ntype = \"sunlit_layer\"\nextinction = 0.01\nsun = \"sun\"\n";
  const Fogs night(layer + "[light.sun]\ntype = \"sun\"\ndirection = [0, -1, 1]\n");
  EXPECT_EQ(night.along({{0, 50, 0}, {0, 0, -1}}).to(100.0).light, Rgb(0.0));
  const Fogs day(layer + kSun);
  const Rgb level = day.along({{0, 50, 0}, {0, 0, -1}}).to(kInfinity).light;
  for (const double rise : {1e-12, -1e-12, 1e-300, -1e-300}) {
    expect_near(day.along({{0, 50, 0}, towards(0, rise, -1)}).to(kInfinity).light, level, 1e-8);
  }
}

TEST(SunlitLayer, needs_a_sun) {
  const std::string layer = "[fog.f]\ntype = \"sunlit_layer\"\nsun = \"lamp\"\n";
  EXPECT_THROW(Fogs(layer + "[light.lamp]\ntype = \"point\"\n"), Error);
  EXPECT_THROW(Fogs{layer + kSun}, Error);
}

TEST(Fog, without_extinction_is_none) {
  const TracedScene scene(
      "[fog.a]\ntype = \"height\"\nextinction = 0\n[fog.b]\ntype = \"distance\"\ndensity = 0\n"
      "[fog.c]\ntype = \"sunlit_layer\"\nthickness = 0\nsun = \"sun\"\n" +
      kSun);
  EXPECT_TRUE(scene.world().fogs.empty());
}

}  // namespace
}  // namespace pileus
