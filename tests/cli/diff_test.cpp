#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/commands.h"
#include "lib/core/error.h"
#include "lib/image/image_io.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

class DiffCommand : public testing::Test {
 protected:
  /// Writes a 4 x 3 picture of one grey value.
  std::string picture(const char* name, float value) const {
    Image image{4, 3, {}, {}};
    for (const char* channel : {"R", "G", "B"}) image.add(channel).values.assign(12, value);
    image.add("Z").values.assign(12, 10.0f * value);
    write_image(folder / name, image);
    return (folder / name).string();
  }

  static Outcome run(std::vector<std::string> arguments) {
    Outcome outcome;
    CLI::App app;
    add_diff_command(app, outcome.exit_code);
    arguments.insert(arguments.begin(), "diff");
    std::reverse(arguments.begin(), arguments.end());  // as CLI11 takes a vector
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const auto finish = [&] {
      outcome.out = testing::internal::GetCapturedStdout();
      outcome.err = testing::internal::GetCapturedStderr();
    };
    try {
      app.parse(arguments);
    } catch (...) {
      finish();
      throw;
    }
    finish();
    return outcome;
  }

  static std::string usage_error(std::vector<std::string> arguments) {
    try {
      run(std::move(arguments));
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage) << error.what();
      return error.what();
    }
    return "accepted";
  }

  TempFolder folder;
};

TEST_F(DiffCommand, prints_every_metric_of_the_pair) {
  const Outcome outcome = run({picture("a.exr", 0.75f), picture("b.exr", 0.5f)});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  for (const char* line : {"4 x 3 pixels, channels R G B\n", "\n  rmse               0.25 radiance ",
                           "\n  relmse         0.240385 ", "\n  nan_pixels            0 pixels "}) {
    EXPECT_NE(outcome.out.find(line), std::string::npos) << line << "\nin\n" << outcome.out;
  }
}

TEST_F(DiffCommand, exits_with_1_and_names_the_conditions_that_hold) {
  const std::string a = picture("a.exr", 0.75f), b = picture("b.exr", 0.5f);
  EXPECT_EQ(run({a, b, "--fail", "rmse>0.25"}).exit_code, 0);
  EXPECT_EQ(run({a, b, "--fail", "rmse >= 0.25"}).exit_code, 1);
  EXPECT_EQ(run({a, b, "--fail", "bias<0.25"}).exit_code, 0);
  EXPECT_EQ(run({a, b, "--fail", "bias<=0.25"}).exit_code, 1);
  const Outcome outcome = run({"--fail", "mae>1", a, b, "--fail", "max>1e-3", "--fail=ssim<2"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err.find("fails: max>1e-3 (max is 0.25)\nfails: ssim<2 (ssim is 0."), 0u) << outcome.err;
}

TEST_F(DiffCommand, pixels_that_cannot_be_compared_fail_unless_allowed) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::string a = picture("a.exr", nan), b = picture("b.exr", 0.5f);
  EXPECT_EQ(run({a, b}).exit_code, 0);
  EXPECT_EQ(run({a, b, "--fail", "rmse>9"}).exit_code, 1);

  Image one = read_image(b);
  one.channels[0].values[5] = nan;
  write_image(folder / "one.exr", one);
  const std::string c = (folder / "one.exr").string();
  const Outcome outcome = run({c, b, "--fail", "rmse>9"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err, "fails: nan_pixels>0 (nan_pixels is 1)\n");
  EXPECT_EQ(run({c, b, "--fail", "rmse>9", "--fail", "nan_pixels>1"}).exit_code, 0);
}

TEST_F(DiffCommand, json_holds_the_same_numbers) {
  const std::string a = picture("a.exr", 0.75f), b = picture("b.exr", 0.5f);
  const auto json = nlohmann::json::parse(run({a, b, "--json", "--fail", "rmse>0.1"}).out);
  EXPECT_EQ(json["width"], 4);
  EXPECT_EQ(json["channels"], (std::vector<std::string>{"R", "G", "B"}));
  EXPECT_EQ(json["metrics"]["rmse"], 0.25);
  EXPECT_TRUE(json["metrics"]["nan_pixels"].is_number_unsigned());
  EXPECT_EQ(json["failed"], std::vector<std::string>{"rmse>0.1"});
  const auto alike = nlohmann::json::parse(run({a, a, "--json"}).out);
  EXPECT_TRUE(alike["metrics"]["psnr"].is_null());
  EXPECT_EQ(alike["metrics"]["flip"], 0.0);
}

TEST_F(DiffCommand, compares_one_channel_and_writes_the_difference) {
  const std::string a = picture("a.exr", 0.5f), b = picture("b.exr", 0.75f);
  const std::string c = (folder / "d.png").string();
  const Outcome outcome = run({a, b, "--channel", "Z", "-o", c, "--scale", "2.5"});
  EXPECT_NE(outcome.out.find("channels Z\n"), std::string::npos);
  EXPECT_NE(outcome.out.find("d.png: blue is -2.5 or less, white 0, red 2.5 or more"), std::string::npos);
  const Image difference = read_image(c);
  EXPECT_EQ(difference.find("R")->values[0], 0.0f);
  EXPECT_EQ(difference.find("B")->values[0], 1.0f);
}

TEST_F(DiffCommand, wrong_usage_is_refused_before_any_file_is_read) {
  const auto refusal = [](std::vector<std::string> options) {
    options.insert(options.begin(), {"missing.exr", "missing.exr"});
    return usage_error(options);
  };
  EXPECT_EQ(refusal({"--fail", "rsme>0.01"}),
            "error: --fail 'rsme>0.01': unknown metric \"rsme\"; expected rmse, mae, max, bias, relmse, "
            "q999, psnr, "
            "ssim, flip or nan_pixels; nearest: rmse");
  EXPECT_EQ(refusal({"--fail", "rmse=3"}),
            "error: --fail 'rmse=3': no comparison found; expected >, >=, < or <=, as in 'rmse>0.01'");
  EXPECT_EQ(refusal({"--fail", "rmse>1%"}),
            "error: --fail 'rmse>1%': \"1%\" is no threshold; expected a number");
  EXPECT_EQ(refusal({"--fail", "rmse>"}), "error: --fail 'rmse>': \"\" is no threshold; expected a number");
  EXPECT_NE(refusal({"--fail", "rmse>nan"}), "accepted");
  EXPECT_EQ(refusal({"--scale", "nan"}), "error: --scale nan is out of range; expected 1e-30 to 1e+30");
  EXPECT_NE(refusal({"--exposure", "1000"}), "accepted");
  EXPECT_NE(refusal({"--pixels-per-degree", "0"}), "accepted");
  EXPECT_NE(refusal({"-o", "d.bmp"}), "accepted");
}

TEST_F(DiffCommand, a_missing_file_and_unequal_sizes_are_errors) {
  const std::string a = picture("a.exr", 0.5f);
  Image small{1, 1, {}, {}};
  small.add("Y");
  write_image(folder / "small.exr", small);
  for (const std::string& other : {(folder / "missing.exr").string(), (folder / "small.exr").string()}) {
    try {
      run({a, other});
      ADD_FAILURE() << other << " was compared";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::file);
    }
  }
}

TEST_F(DiffCommand, help_shows_metrics_and_examples) {
  CLI::App app;
  int exit_code = 0;
  add_diff_command(app, exit_code);
  const std::string help = app.get_subcommand("diff")->help();
  EXPECT_NE(help.find("pileus diff dusk.exr reference.exr --fail"), std::string::npos);
  EXPECT_NE(help.find("99.9 %"), std::string::npos);
}

}  // namespace
}  // namespace pileus
