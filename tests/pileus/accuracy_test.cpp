// What accuracy costs: fits, fronts and read-offs with answers computed by hand, and studies of a small
// scene.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lib/core/param_table.h"
#include "pileus/accuracy/analysis.h"
#include "pileus/accuracy/budget.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// ---- power laws ----

TEST(PowerLaw, is_found_where_points_follow_one) {
  const std::vector<double> x{1.0, 2.0, 4.0, 8.0}, y{3.0, 12.0, 48.0, 192.0};  // 3 x^2
  const auto law = fit_power_law(x, y);
  ASSERT_TRUE(law);
  EXPECT_NEAR(law->exponent, 2.0, 1e-14);
  EXPECT_NEAR(law->factor, 3.0, 1e-13);
  EXPECT_EQ(law->points, 4u);
  EXPECT_NEAR(law->at(3.0), 27.0, 1e-12);
  EXPECT_NEAR(law->solve(27.0), 3.0, 1e-13);
}

TEST(PowerLaw, is_the_least_squares_line_of_the_logarithms) {
  // log10: x = 0, 1, 2 and y = 0, 2, 1. The mean of y is 1, the slope (-1 * -1 + 0 + 1 * 0) / 2 = 1/2.
  const std::vector<double> x{1.0, 10.0, 100.0}, y{1.0, 100.0, 10.0};
  const auto law = fit_power_law(x, y);
  ASSERT_TRUE(law);
  EXPECT_NEAR(law->exponent, 0.5, 1e-14);
  EXPECT_NEAR(law->factor, std::sqrt(10.0), 1e-13);
}

TEST(PowerLaw, leaves_out_what_has_no_logarithm) {
  const std::vector<double> x{1.0, 0.0, 2.0, 4.0, kNaN, 8.0}, y{1.0, 5.0, 0.0, 4.0, 1.0, kInfinity};
  const auto law = fit_power_law(x, y);
  ASSERT_TRUE(law);
  EXPECT_EQ(law->points, 2u);
  EXPECT_NEAR(law->exponent, 1.0, 1e-14);
}

TEST(PowerLaw, needs_two_different_places) {
  const std::vector<double> none, one{2.0}, same{2.0, 2.0}, values{1.0, 3.0};
  EXPECT_FALSE(fit_power_law(none, none));
  EXPECT_FALSE(fit_power_law(one, one));
  EXPECT_FALSE(fit_power_law(same, values));
}

// ---- trade-offs ----

TEST(ParetoFront, holds_what_no_other_point_beats) {
  const std::vector<CostError> points{{1, 9}, {2, 5}, {3, 6},    {4, 5},
                                      {5, 1}, {2, 5}, {kNaN, 0}, {0.5, kInfinity}};
  //                                   front   front  worse   slower front   as the 2nd  no numbers
  EXPECT_EQ(pareto_front(points), (std::vector<bool>{true, true, false, false, true, true, false, false}));
  EXPECT_TRUE(pareto_front({}).empty());
}

TEST(CostAtError, is_interpolated_in_logarithms) {
  // Ten times the cost for a hundredth of the error: half way in the logarithm of the error is so in the
  // cost's.
  const std::vector<CostError> points{{10.0, 1e-4}, {1.0, 1e-2}};
  const ReadOff middle = cost_at_error(points, 1e-3);
  EXPECT_EQ(middle.kind, ReadOff::Kind::interpolated);
  EXPECT_NEAR(middle.value, std::sqrt(10.0), 1e-13);
  EXPECT_EQ(cost_at_error(points, 1e-4).value, 10.0);
  const ReadOff coarse = cost_at_error(points, 0.5);
  EXPECT_EQ(coarse.kind, ReadOff::Kind::at_most);
  EXPECT_EQ(coarse.value, 1.0);
  EXPECT_EQ(cost_at_error(points, 1e-5).kind, ReadOff::Kind::out_of_reach);
  EXPECT_EQ(cost_at_error({}, 1e-2).kind, ReadOff::Kind::out_of_reach);
}

TEST(CostAtError, takes_no_notice_of_points_that_the_method_itself_beats) {
  const std::vector<CostError> points{{1.0, 1e-2}, {5.0, 2e-2}, {100.0, 1e-2}, {10.0, 1e-4}};
  EXPECT_NEAR(cost_at_error(points, 1e-3).value, std::sqrt(10.0), 1e-13);
}

TEST(ErrorAtCost, is_interpolated_in_logarithms) {
  const std::vector<CostError> points{{1.0, 1e-2}, {100.0, 1e-4}};
  EXPECT_NEAR(error_at_cost(points, 10.0).value, 1e-3, 1e-16);
  EXPECT_EQ(error_at_cost(points, 0.5).kind, ReadOff::Kind::out_of_reach);
  const ReadOff late = error_at_cost(points, 1000.0);
  EXPECT_EQ(late.kind, ReadOff::Kind::at_most);
  EXPECT_EQ(late.value, 1e-4);
}

TEST(Spread, has_the_mean_of_the_middle_two_as_the_median_of_an_even_count) {
  const Spread odd = spread_of({3.0, 1.0, 2.0}), even = spread_of({8.0, 1.0, 4.0, 2.0});
  EXPECT_EQ(odd.median, 2.0);
  EXPECT_EQ(even.median, 3.0);
  EXPECT_EQ(even.min, 1.0);
  EXPECT_EQ(even.max, 8.0);
}

// ---- methods ----

struct Switched final : Integrator {
  bool leaping = true, coarse = false;
  double step = 0.0;
  int depth = 3;
  std::string storage = "float";

  void describe(ParamTable& params) override {
    params.boolean("leaping", leaping, "");
    params.boolean("coarse", coarse, "");
    params.integer("depth", depth, "");
    params.text("storage", storage, "").one_of({"float", "16-bit"});
    if (plugin_name == "stepped") params.number("step", step, "m", "");
  }
  std::unique_ptr<const Tracer> prepare(const World&, const EffectPlan&, const Accuracy&) const override {
    return nullptr;
  }
};

std::vector<std::string> names_of(const std::vector<AccuracyMethod>& methods) {
  std::vector<std::string> names;
  for (const AccuracyMethod& method : methods) names.push_back(method.name);
  return names;
}

TEST(AccuracyMethods, are_the_integrators_and_each_of_their_switches_turned) {
  Registry registry;
  registry.add<Integrator, Switched>("march", "");
  registry.add<Integrator, Switched>("stepped", "");
  const auto methods = accuracy_methods(registry);
  EXPECT_EQ(names_of(methods),
            (std::vector<std::string>{"march", "march:leaping=false", "march:coarse=true",
                                      "march:storage=16-bit", "stepped", "stepped:leaping=false",
                                      "stepped:coarse=true", "stepped:storage=16-bit"}));
  EXPECT_FALSE(methods[0].is_set_by_step);
  EXPECT_TRUE(methods[4].is_set_by_step);
  EXPECT_EQ(integrator_text({methods[2], 0.0, 0.01}), "{ type = \"march\", coarse = true }");
  EXPECT_EQ(integrator_text({methods[3], 0.0, 0.01}), "{ type = \"march\", storage = \"16-bit\" }");
  EXPECT_EQ(integrator_text({methods[5], 0.5, 0.01}), "{ type = \"stepped\", leaping = false, step = 0.5 }");
}

TEST(AccuracyMethods, can_be_chosen_by_name) {
  const auto all = accuracy_methods(plugin_registry());
  EXPECT_EQ(names_of(chosen_methods(all, {"uniform", "exact"})),
            (std::vector<std::string>{"exact", "uniform"}));
  EXPECT_EQ(chosen_methods(all, {}).size(), all.size());
  try {
    chosen_methods(all, {"unifrom"});
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_NE(std::string(error.what()).find("nearest: uniform"), std::string::npos) << error.what();
  }
}

// ---- errors that integrators state ----

Image grey(const std::vector<float>& values) {
  Image image{int(values.size()), 1, {}, {}};
  for (const char* name : {"R", "G", "B"}) image.add(name).values = values;
  return image;
}

TEST(OwnError, is_judged_pixel_by_pixel) {
  AccuracyReference reference;
  reference.image = grey({0.0f, 0.0f, 0.0f, 0.0f, 0.0f});
  reference.image.add("error_estimate").values = {0.0f, 0.0f, 0.0f, 0.0f, 0.25f};
  Image picture = grey({0.125f, -0.25f, 0.0f, 0.5f, 0.25f});
  EXPECT_FALSE(judge_own_error(picture, "error_bound", reference));
  picture.add("error_bound").values = {0.25f, 1.0f, 0.0625f, 0.375f, 0.125f};
  // Bound over error: 2, 4, no error, 0.75 and thus exceeded; the last is within what the reference may be
  // off.
  const auto own = judge_own_error(picture, "error_bound", reference);
  ASSERT_TRUE(own);
  EXPECT_EQ(own->exceeded, 1u);
  EXPECT_EQ(own->effectivity, 2.0);
  EXPECT_EQ(own->max, 1.0);
  EXPECT_DOUBLE_EQ(own->mean, (0.25 + 1.0 + 0.0625 + 0.375 + 0.125) / 5.0);
  picture.channels.back().values.assign(5, std::numeric_limits<float>::quiet_NaN());
  EXPECT_FALSE(judge_own_error(picture, "error_bound", reference)) << "no number, no bound";
}

// ---- studies ----

const std::string kScene = R"(pileus = 1
[render]
size = [24, 16]
[camera]
type = "perspective"
[light.sun]
type = "sun"
[volume.ball]
type = "ellipsoid"
extinction = 2
[volume.fog]
type = "box"
min = [-0.4, -0.8, -2]
max = [0.7, 0.3, 1.5]
)";

AccuracyOptions quick_options() {
  AccuracyOptions options;
  options.repeat = 2;
  options.threads = 2;
  options.tolerances = {0.01, 0.001};
  return options;
}

TEST(Accuracy, of_the_midpoint_marcher_is_of_a_higher_order_than_that_of_the_left_sample) {
  AccuracyOptions options = quick_options();
  options.methods = {"uniform", "uniform:sample=left"};
  const AccuracyStudy study = measure_accuracy(parse_scene(kScene, "test", ""), options);
  ASSERT_EQ(study.runs.size(), 12u);
  const AccuracyAnalysis analysis = analyse(study);
  ASSERT_EQ(analysis.methods.size(), 2u);
  EXPECT_NEAR(analysis.methods[1].order->exponent, 1.0, 0.15);
  EXPECT_GT(study.runs[6].difference.rmse, study.runs[0].difference.rmse);
  for (size_t i = 0; i < study.runs.size(); ++i) {
    const AccuracyRun& run = study.runs[i];
    EXPECT_LE(run.total.min, run.total.median);
    EXPECT_LE(run.total.median, run.total.max);
    EXPECT_LE(run.render.min, run.total.min);
    EXPECT_GT(run.lookups(), 0.0);
    EXPECT_TRUE(run.is_resolved);
    EXPECT_EQ(run.picture != nullptr, i % 6 == 0 || i % 6 == 5) << "of the coarsest and the finest alone";
    EXPECT_FALSE(run.estimate || run.bound);
    if (i % 6 > 0) {
      EXPECT_EQ(run.setting.step, 0.5 * study.runs[i - 1].setting.step);
    }
  }
}

TEST(Accuracy, goes_from_coarse_to_fine_and_counts_progress_up_to_1) {
  AccuracyOptions options = quick_options();
  options.tolerances = {0.001, 0.1, 0.01};
  options.methods = {"exact"};
  std::vector<double> shares;
  options.progress = [&](double share) { shares.push_back(share); };
  const AccuracyStudy study = measure_accuracy(parse_scene(kScene, "test", ""), options);
  ASSERT_EQ(study.runs.size(), 3u);
  EXPECT_EQ(study.runs.front().setting.tolerance, 0.1);
  EXPECT_EQ(study.runs.back().setting.tolerance, 0.001);
  EXPECT_TRUE(study.runs.front().estimate);
  EXPECT_EQ(study.threads, 2);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_DOUBLE_EQ(shares.back(), 1.0);
}

TEST(Accuracy, keeps_its_reference_and_takes_it_again_where_it_fits) {
  const TempFolder folder;
  AccuracyOptions options = quick_options();
  options.methods = {"exact"};
  options.folder = folder.path();
  const auto reuses = [&](const std::vector<std::string>& overrides) {
    return measure_accuracy(parse_scene(kScene, "test", "", overrides), options).reference.is_reused;
  };
  EXPECT_FALSE(reuses({}));
  EXPECT_TRUE(reuses({}));
  EXPECT_FALSE(reuses({"volume.ball.extinction=3"}));
  EXPECT_FALSE(reuses({"render.size=[24, 17]"}));
  EXPECT_FALSE(reuses({}));
  options.tolerances = {0.01, 0.0001};
  EXPECT_FALSE(reuses({})) << "a finer reference is needed";
  EXPECT_TRUE(reuses({}));
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(Accuracy, gives_up_what_takes_too_long_and_says_so) {
  AccuracyOptions options = quick_options();
  options.methods = {"exact", "uniform"};
  options.run_limit = 1e-3;
  const Scene scene = parse_scene(kScene, "test", "", {"render.size=[64, 48]"});
  try {
    const AccuracyStudy study = measure_accuracy(scene, options);
    EXPECT_LT(study.runs.size(), 8u);
    EXPECT_FALSE(study.notes.empty());
  } catch (const Error& error) {  // even the first run was too slow
    EXPECT_EQ(error.kind(), ErrorKind::failed);
  }
}

TEST(Accuracy, can_be_cancelled) {
  AccuracyOptions options = quick_options();
  options.is_cancelled = [] { return true; };
  try {
    measure_accuracy(parse_scene(kScene, "test", ""), options);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::cancelled);
  }
}

TEST(Accuracy, names_no_price_where_there_is_none) {
  AccuracyStudy study;
  const std::string text = conclusion(study, analyse(study));
  EXPECT_EQ(text, "No method has two runs whose errors differ and can be told: accuracy has no price here.");
}

TEST(Budget, is_kept_and_bought_with) {
  AccuracyOptions options = quick_options();
  const Scene scene = parse_scene(kScene, "test", "");
  const BudgetAnswer answer = best_within(scene, 0.05, options);
  EXPECT_LE(answer.best.total.median, 0.05);
  for (const AccuracyRun& run : answer.measured) {
    if (run.total.median <= 0.05) {
      EXPECT_LE(answer.best.difference.rmse, run.difference.rmse);
    }
    EXPECT_EQ(run.setting.method.parameter, "") << "integrators as they come, where none is named";
  }
}

TEST(Budget, too_small_for_anything_is_an_error) {
  try {
    best_within(parse_scene(kScene, "test", ""), 1e-9, quick_options());
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::failed);
  }
}

}  // namespace
}  // namespace pileus
