// render(): the same pixels however they are computed, and planes that mean what they say.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "lib/image/image_io.h"
#include "pileus/pileus.h"
#include "tests/fixtures/random_grid.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// All effects at once, in a picture that no tile divides evenly.
const std::string kScene = R"(pileus = 1
[render]
size = [50, 37]
aovs = "beauty,transmittance,Z,samples,error_estimate"
[camera]
type = "perspective"
position = [0, 1, 5]
[background]
type = "gradient"
[light.sun]
type = "sun"
[light.lamp]
type = "point"
position = [1, 1, 1]
intensity = [3, 2, 1]
[object.ground]
type = "plane"
point = [0, -1, 0]
[object.ball]
type = "sphere"
center = [1, -0.5, 0]
radius = 0.5
[volume.cloud]
type = "ellipsoid"
extinction = 2
phase = { type = "hg", g = 0.5 }
[volume.fog]
type = "box"
min = [-3, -1, -3]
max = [3, 0, 3]
extinction = 0.3
emission = [0, 0, 0.1]
)";

Scene scene_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return parse_scene(text, "test", "", overrides);
}

Image image_of(const std::string& text, const std::vector<std::string>& overrides = {},
               const RenderOptions& options = {}) {
  return render(scene_of(text, overrides), options).image;
}

float pixel(const Image& image, const char* channel, int x, int y) {
  return image.find(channel)->values.at(size_t(y) * size_t(image.width) + size_t(x));
}

/// Bit for bit: also NaN and -0 count.
void expect_same_pixels(const Image& a, const Image& b) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (size_t c = 0; c < a.channels.size(); ++c) {
    const auto &x = a.channels[c].values, &y = b.channels[c].values;
    ASSERT_EQ(a.channels[c].name, b.channels[c].name);
    ASSERT_EQ(x.size(), y.size());
    EXPECT_EQ(std::memcmp(x.data(), y.data(), x.size() * sizeof(float)), 0) << a.channels[c].name;
  }
}

struct EveryIntegrator : testing::TestWithParam<const char*> {
  std::string integrator() const { return std::string("render.integrator=") + GetParam(); }
};
INSTANTIATE_TEST_SUITE_P(Render, EveryIntegrator, testing::Values("exact", "uniform"),
                         [](const auto& test) { return std::string(test.param); });

TEST_P(EveryIntegrator, pixels_do_not_depend_on_the_number_of_threads) {
  RenderOptions options;
  options.threads = 1;
  const Image one = image_of(kScene, {integrator()}, options);
  for (const int threads : {2, 7}) {
    options.threads = threads;
    const Rendering many = render(scene_of(kScene, {integrator()}), options);
    EXPECT_EQ(many.report.threads, threads);
    expect_same_pixels(many.image, one);
  }
}

TEST_P(EveryIntegrator, a_crop_has_the_pixels_of_the_whole_picture) {
  const Image whole = image_of(kScene, {integrator()});
  for (const Crop crop : {Crop{0, 0, 1, 1}, Crop{7, 5, 41, 30}, Crop{49, 36, 50, 37}, Crop{0, 20, 50, 21}}) {
    RenderOptions options;
    options.crop = crop;
    const Image part = image_of(kScene, {integrator()}, options);
    ASSERT_EQ(part.width, crop.x1 - crop.x0);
    ASSERT_EQ(part.height, crop.y1 - crop.y0);
    for (const Channel& channel : part.channels) {
      for (int y = 0; y < part.height; ++y) {
        for (int x = 0; x < part.width; ++x) {
          const float got = pixel(part, channel.name.c_str(), x, y);
          const float expected = pixel(whole, channel.name.c_str(), crop.x0 + x, crop.y0 + y);
          ASSERT_EQ(std::memcmp(&got, &expected, sizeof(float)), 0)
              << channel.name << " at " << x << ", " << y;
        }
      }
    }
  }
}

TEST_P(EveryIntegrator, alpha_is_one_minus_transmittance) {
  const Image image = image_of(kScene, {integrator(), "object={}"});
  float least = 1.0f, most = 0.0f;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const float alpha = pixel(image, "A", x, y);
      EXPECT_NEAR(alpha, 1.0f - pixel(image, "transmittance", x, y), 6e-8) << "but for rounding to floats";
      least = std::min(least, alpha), most = std::max(most, alpha);
    }
  }
  EXPECT_EQ(least, 0.0f);
  EXPECT_GT(most, 0.9f);
}

TEST_P(EveryIntegrator, pixel_samples_average_a_regular_grid_of_rays) {
  const std::string planes = "render.aovs=beauty,transmittance,samples";
  const Image fine = image_of(kScene, {integrator(), planes, "render.size=[48, 36]"});
  const Image mean =
      image_of(kScene, {integrator(), planes, "render.size=[16, 12]", "render.pixel_samples=3"});
  for (const char* name : {"R", "G", "B", "A", "transmittance"}) {
    for (int y = 0; y < mean.height; ++y) {
      for (int x = 0; x < mean.width; ++x) {
        double sum = 0.0;
        for (int n = 0; n < 9; ++n) sum += pixel(fine, name, 3 * x + n % 3, 3 * y + n / 3);
        // The rays differ in their last digits only.
        EXPECT_NEAR(pixel(mean, name, x, y), sum / 9.0, 1e-5) << name << " at " << x << ", " << y;
      }
    }
  }
}

TEST_P(EveryIntegrator, cancelling_throws_and_leaves_no_picture) {
  for (const int after : {0, 5}) {
    std::atomic<int> polls{0};
    RenderOptions options;
    options.is_cancelled = [&] { return ++polls > after; };
    try {
      image_of(kScene, {integrator()}, options);
      ADD_FAILURE() << "was not cancelled";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::cancelled);
    }
  }
}

TEST_P(EveryIntegrator, a_render_resumed_again_and_again_equals_a_whole_one) {
  const TempFolder folder;
  RenderOptions options;
  options.threads = 2;
  options.checkpoint = folder / "checkpoint.exr";
  const Rendering whole = render(scene_of(kScene, {integrator()}));
  Rendering resumed;
  int attempts = 0;
  for (bool done = false; !done; ++attempts) {
    ASSERT_LT(attempts, 12) << "each finishes some of the 12 tiles";
    std::atomic<int> tiles{-1};  // the first call of progress has none
    options.progress = [&](double) { ++tiles; };
    options.is_cancelled = [&] { return tiles >= 3; };
    try {
      resumed = render(scene_of(kScene, {integrator()}), options);
      done = true;
    } catch (const Error& error) {
      ASSERT_EQ(error.kind(), ErrorKind::cancelled);
      ASSERT_TRUE(std::filesystem::exists(options.checkpoint));
    }
  }
  EXPECT_GT(attempts, 2);
  expect_same_pixels(resumed.image, whole.image);
  EXPECT_EQ(resumed.report.max_error_estimate, whole.report.max_error_estimate);
  EXPECT_EQ(resumed.report.mean_error_estimate, whole.report.mean_error_estimate);
}

TEST(Render, a_checkpoint_of_another_render_is_refused) {
  const TempFolder folder;
  RenderOptions options;
  options.checkpoint = folder / "checkpoint.exr";
  options.is_cancelled = [] { return true; };
  EXPECT_THROW(image_of(kScene, {}, options), Error);
  options.is_cancelled = nullptr;
  const auto refusal = [&](const std::vector<std::string>& overrides, const RenderOptions& changed) {
    try {
      image_of(kScene, overrides, changed);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      return true;
    }
    return false;
  };
  EXPECT_TRUE(refusal({"render.tolerance=0.1"}, options));
  EXPECT_TRUE(refusal({"render.size=[50, 38]"}, options));
  EXPECT_TRUE(refusal({"render.aovs=beauty"}, options));
  RenderOptions cropped = options;
  cropped.crop = Crop{0, 0, 10, 10};
  EXPECT_TRUE(refusal({}, cropped));
  EXPECT_FALSE(refusal({}, options));
}

TEST(Render, a_checkpoint_of_a_changed_volume_is_refused) {
  const TempFolder folder;
  const auto render_grid = [&](const RenderOptions& options) {
    return image_of(fmt::format("pileus = 1\ncamera = \"perspective\"\n[render]\nsize = [20, 20]\n"
                                "[volume.grid]\ntype = \"vdb\"\nfile = \"{}\"\n",
                                (folder / "grid.vdb").string()),
                    {}, options);
  };
  write_grid(folder / "grid.vdb", random_grid(4, 1));
  RenderOptions options;
  options.checkpoint = folder / "checkpoint.exr";
  options.is_cancelled = [] { return true; };
  EXPECT_THROW(render_grid(options), Error);
  options.is_cancelled = nullptr;
  write_grid(folder / "grid.vdb", random_grid(5, 2));
  EXPECT_THROW(render_grid(options), Error);
  std::filesystem::remove(options.checkpoint);
  EXPECT_NO_THROW(render_grid(options));
}

TEST(Render, a_time_limit_gives_a_coarser_picture_and_says_so) {
  RenderOptions options;
  options.time_limit = 0.5;
  // Whole, this takes many times longer; at the coarsest there is one step per volume.
  const Rendering short_one = render(
      scene_of(kScene, {"render.size=[160, 120]", "render.integrator={ type = \"uniform\", step = 0.01 }"}),
      options);
  EXPECT_GT(short_one.report.coarseness, 1.0);
  EXPECT_LT(short_one.report.seconds.at("wall"), 1.5);
  EXPECT_EQ(short_one.report.nan_pixels, 0u);
  options.time_limit = 1000.0;
  const Rendering long_one = render(scene_of(kScene), options);
  EXPECT_EQ(long_one.report.coarseness, 1.0);
  expect_same_pixels(long_one.image, image_of(kScene));
}

TEST(Render, a_time_limit_is_used_well) {
  // Cost is a power of the coarseness here, so that the finest affordable one is known in a few passes. The
  // ladder of a fixed factor 4 would leave up to 15/16 of the time unused.
  const Scene scene =
      scene_of(kScene, {"render.size=[96, 72]", "render.integrator={ type = \"uniform\", step = 0.002 }"});
  RenderOptions options;
  options.time_limit = 1.0;
  const RenderReport report = render(scene, options).report;
  EXPECT_GT(report.coarseness, 1.0) << "this machine is too fast for the scene";
  EXPECT_LT(report.coarseness, 1000.0);
  EXPECT_LT(report.seconds.at("wall"), 2.0);
  EXPECT_TRUE(report.warnings.empty());
}

TEST(Render, a_time_limit_reports_the_error_that_was_reached) {
  RenderOptions options;
  options.time_limit = 1e-3;
  const Scene scene = scene_of(kScene, {"render.size=[200, 150]", "render.tolerance=1e-6"});
  const RenderReport report = render(scene, options).report;
  EXPECT_GT(report.coarseness, 1.0);
  ASSERT_TRUE(report.max_error_estimate);
  EXPECT_GT(*report.max_error_estimate, 1e-6);
  EXPECT_LE(*report.max_error_estimate, 1e-6 * report.coarseness * 1.0001);
}

TEST(Render, a_time_limit_too_short_for_any_picture_gives_the_coarsest_one_late) {
  RenderOptions options;
  options.time_limit = 1e-9;
  const Rendering late =
      render(scene_of(kScene, {"render.size=[160, 120]", "render.pixel_samples=2"}), options);
  EXPECT_EQ(late.report.nan_pixels, 0u);
  EXPECT_GT(late.report.coarseness, 1.0);
  ASSERT_EQ(late.report.warnings.size(), 1u);
  EXPECT_EQ(late.report.warnings.front().find("1e-09 s were too short even for the coarsest picture"), 0u);
}

TEST(Render, a_time_limit_can_be_cancelled_in_its_first_pass) {
  RenderOptions options;
  options.time_limit = 1e-9;
  options.is_cancelled = [] { return true; };
  EXPECT_THROW(image_of(kScene, {}, options), Error);
}

TEST(Render, progress_starts_at_0_ends_at_1_and_never_falls) {
  RenderOptions options;
  options.threads = 7;
  std::vector<double> shares;
  options.progress = [&](double share) { shares.push_back(share); };  // from one thread at a time
  image_of(kScene, {}, options);
  ASSERT_EQ(shares.size(), 1u + 4 * 3);
  EXPECT_EQ(shares.front(), 0.0);
  EXPECT_EQ(shares.back(), 1.0);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
}

/// Tiles that see nothing else are filled with a background of one colour; a gradient between equal colours
/// looks the same, but is asked ray by ray.
TEST(Render, tiles_that_see_nothing_else_have_the_background) {
  const TempFolder folder;
  write_grid(folder / "grid.vdb", random_grid(4, 1));
  const auto scene = [&](const std::string& background) {
    return fmt::format(R"(pileus = 1
[render]
size = [150, 90]
aovs = "beauty,transmittance,Z,error_estimate"
pixel_samples = 2
[camera]
type = "perspective"
position = [0, 0, 90]
[background]
{}
[light.sun]
type = "sun"
[volume.grid]
type = "vdb"
file = "{}"
[volume.haze]
type = "ellipsoid"
center = [-20, 10, 0]
radii = [5, 4, 3]
extinction = 0.2
)",
                       background, (folder / "grid.vdb").string());
  };
  const std::string colour = "[0.1, 0.7, 0.3]";
  const std::string filled = scene("type = \"constant\"\nradiance = " + colour),
                    traced = scene(fmt::format(
                        "type = \"gradient\"\nzenith = {0}\nhorizon = {0}\nground = {0}", colour));
  for (const char* integrator : {"exact", "march"}) {
    for (const bool is_cropped : {false, true}) {
      const std::string with = std::string("render.integrator=") + integrator;
      RenderOptions options;
      if (is_cropped) options.crop = Crop{33, 1, 149, 88};
      expect_same_pixels(image_of(filled, {with}, options), image_of(traced, {with}, options));
    }
  }
}

TEST(Render, crops_outside_of_the_picture_are_refused) {
  for (const Crop crop :
       {Crop{-1, 0, 5, 5}, Crop{0, 0, 51, 5}, Crop{0, 0, 5, 38}, Crop{5, 5, 5, 6}, Crop{6, 5, 5, 6},
        Crop{std::numeric_limits<int>::min(), 0, std::numeric_limits<int>::max(), 1}}) {
    RenderOptions options;
    options.crop = crop;
    EXPECT_THROW(image_of(kScene, {}, options), Error);
  }
}

TEST(Render, the_report_counts_what_was_done) {
  const Rendering rendering = render(scene_of(kScene, {"render.pixel_samples=2"}));
  const RenderReport& report = rendering.report;
  EXPECT_EQ(report.pixels, 50u * 37u);
  EXPECT_EQ(report.rays, 4 * report.pixels);
  EXPECT_EQ(report.integrator, "march");
  EXPECT_EQ(report.nan_pixels, 0u);
  EXPECT_GT(report.peak_memory_bytes, 1u << 20);
  EXPECT_LE(*report.mean_error_estimate, *report.max_error_estimate);
  EXPECT_LE(*report.max_error_estimate, 0.002);
  EXPECT_GT(report.counters.at("density_samples"), 0u);

  const Rendering bare = render(scene_of("pileus = 1\ncamera = \"perspective\"\nrender.size = [8, 8]\n"));
  for (const auto& [name, count] : bare.report.counters) EXPECT_EQ(count, 0u) << name << " in an empty scene";
}

TEST(Render, an_integrator_without_an_estimate_reports_none) {
  const RenderReport report = render(scene_of(kScene, {"render.integrator=uniform"})).report;
  EXPECT_FALSE(report.max_error_estimate || report.mean_error_estimate);
}

const std::string kCloud = R"(pileus = 1
[render]
size = [24, 18]
integrator = "march"
aovs = "beauty,error_bound"
[camera]
type = "perspective"
position = [0, 0, 4]
[background]
type = "gradient"
[light.sun]
type = "sun"
[freeform.blob]
base = { ellipsoid = { center = [0, 0, 0], radii = [1.2, 0.8, 0.7] } }
[volume.cloud]
type = "cloud"
bounds = "blob"
voxel_size = 0.1
extinction = 8
)";

TEST(Render, no_channel_errs_by_more_than_its_bound) {
  const Rendering marched = render(scene_of(kCloud, {"render.pixel_samples=2"}));
  const Image exact = image_of(kCloud, {"render.pixel_samples=2", "render.integrator=exact",
                                        "render.tolerance=1e-8", "render.aovs=beauty"});
  const std::vector<float>& bounds = marched.image.find("error_bound")->values;
  for (const char* channel : {"R", "G", "B"}) {
    for (size_t i = 0; i < bounds.size(); ++i) {
      const float rounding = 1e-7f * exact.find(channel)->values[i];  // of the exact picture to floats
      EXPECT_LE(std::abs(marched.image.find(channel)->values[i] - exact.find(channel)->values[i]),
                bounds[i] + rounding)
          << channel << " of pixel " << i;
    }
  }
  ASSERT_TRUE(marched.report.max_error_bound && marched.report.mean_error_bound);
  EXPECT_EQ(*marched.report.max_error_bound, double(*std::max_element(bounds.begin(), bounds.end())));
  EXPECT_GT(*marched.report.mean_error_bound, 0.0);
  EXPECT_LT(*marched.report.max_error_bound, 0.01);
}

TEST(Render, a_bound_in_a_file_of_halves_holds_for_the_halves) {
  const TempFolder folder;
  const Rendering marched = render(scene_of(kCloud));
  const Image exact =
      image_of(kCloud, {"render.integrator=exact", "render.tolerance=1e-8", "render.aovs=beauty"});
  save(marched, folder / "half.exr", true);
  const Image half = read_image(folder / "half.exr");
  const auto& bounds = half.find("error_bound")->values;
  for (const char* channel : {"R", "G", "B"}) {
    const auto &a = half.find(channel)->values, &b = exact.find(channel)->values;
    for (size_t i = 0; i < bounds.size(); ++i)
      EXPECT_LE(std::abs(a[i] - b[i]), bounds[i] + 1e-7f * b[i]) << channel;
  }
}

TEST(Render, who_proves_no_bound_reports_none) {
  for (const char* override : {"render.integrator=exact", "render.tolerance=0"}) {
    const Rendering rendering = render(scene_of(kCloud, {override}));
    EXPECT_FALSE(rendering.report.max_error_bound || rendering.report.mean_error_bound);
    EXPECT_TRUE(std::isnan(pixel(rendering.image, "error_bound", 12, 9)));
  }
  const std::vector<std::string> choices = render(scene_of(kCloud, {"render.tolerance=0"})).report.choices;
  EXPECT_TRUE(std::any_of(choices.begin(), choices.end(), [](const std::string& choice) {
    return choice.rfind("error_bound: none", 0) == 0;
  }));
  EXPECT_FALSE(render(scene_of(kCloud, {"render.aovs=beauty"})).report.max_error_bound);
}

// ---- distances on scenes known on paper ----

const std::string kOrthographic = R"(pileus = 1
[render]
size = [3, 3]
aovs = "beauty,transmittance,Z"
[camera]
type = "orthographic"
position = [0, 0, 5]
width = 0.3
)";
const std::string kSlab = "[volume.slab]\ntype = \"box\"\nmin = [-9, -9, -1]\nmax = [9, 9, 1]\n";

TEST(Render, an_empty_scene_is_infinitely_deep) {
  const Image image = image_of(kOrthographic);
  EXPECT_EQ(pixel(image, "Z", 1, 1), float(kInfinity));
  EXPECT_EQ(pixel(image, "Z_half", 1, 1), float(kInfinity));
  EXPECT_EQ(pixel(image, "transmittance", 1, 1), 1.0f);
  EXPECT_EQ(pixel(image, "A", 1, 1), 0.0f);
}

TEST(Render, Z_is_the_front_of_a_slab_and_Z_half_lies_ln_2_deep) {
  const Image image = image_of(kOrthographic + kSlab);
  EXPECT_FLOAT_EQ(pixel(image, "Z", 1, 1), 4.0f);
  EXPECT_FLOAT_EQ(pixel(image, "Z_half", 1, 1), float(4.0 + std::log(2.0)));
  EXPECT_FLOAT_EQ(pixel(image, "transmittance", 1, 1), float(std::exp(-2.0)));
}

TEST(Render, Z_half_of_a_thin_slab_is_that_of_what_stands_behind) {
  const std::string thin = kOrthographic + kSlab + "extinction = 0.1\n";
  EXPECT_EQ(pixel(image_of(thin), "Z_half", 1, 1), float(kInfinity));
  const Image image =
      image_of(thin + "[object.wall]\ntype = \"plane\"\npoint = [0, 0, -3]\nnormal = [0, 0, 1]\n");
  EXPECT_FLOAT_EQ(pixel(image, "Z", 1, 1), 4.0f);
  EXPECT_FLOAT_EQ(pixel(image, "Z_half", 1, 1), 8.0f);
  EXPECT_EQ(pixel(image, "transmittance", 1, 1), 0.0f);
  EXPECT_EQ(pixel(image, "A", 1, 1), 1.0f);
}

TEST(Render, a_solid_in_front_hides_the_medium) {
  const Image image =
      image_of(kOrthographic + kSlab + "[object.ball]\ntype = \"sphere\"\ncenter = [0, 0, 3]\nradius = 1\n");
  EXPECT_FLOAT_EQ(pixel(image, "Z", 1, 1), 1.0f);
  EXPECT_FLOAT_EQ(pixel(image, "Z_half", 1, 1), 1.0f);
}

}  // namespace
}  // namespace pileus
