// `pileus accuracy`: the table, the page, the sentence, the budget.
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <map>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/program.h"

namespace pileus {
namespace {

using Json = nlohmann::json;
using Row = std::map<std::string, std::string>;

struct Accuracy : testing::Test, ProgramTest {
  Accuracy() { write("scene.toml", kSmallScene); }
};

/// The rows of an RFC 4180 file by their column names.
std::vector<Row> parse_csv(const std::string& text) {
  std::vector<std::vector<std::string>> rows{{""}};
  bool in_quotes = false;
  for (size_t i = 0; i < text.size(); ++i) {
    std::string& field = rows.back().back();
    if (text[i] == '"') {
      if (in_quotes && text.substr(i + 1, 1) == "\"") {
        field += text[++i];
      } else {
        in_quotes = !in_quotes;
      }
    } else if (!in_quotes && text[i] == ',') {
      rows.back().emplace_back();
    } else if (!in_quotes && text.substr(i, 2) == "\r\n") {
      rows.push_back({""});
      ++i;
    } else {
      field += text[i];
    }
  }
  EXPECT_EQ(rows.back(), std::vector<std::string>{""}) << "the last line ends in CR LF";
  rows.pop_back();
  std::vector<Row> result;
  for (size_t r = 1; r < rows.size(); ++r) {
    EXPECT_EQ(rows[r].size(), rows[0].size());
    Row& row = result.emplace_back();
    for (size_t c = 0; c < rows[0].size(); ++c) row[rows[0][c]] = rows[r].at(c);
  }
  return result;
}

/// What a tenth of the error costs, from the table: 10^-b of the least-squares line log s = a + b log rmse.
double cost_of_a_digit(const std::vector<Row>& rows, const std::string& method) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const Row& row : rows) {
    if (row.at("method") != method || row.at("is_resolved") != "1") continue;
    const double x = std::log10(std::stod(row.at("rmse"))),
                 y = std::log10(std::stod(row.at("seconds_median")));
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return std::pow(10.0, -(n * sxy - sx * sy) / (n * sxx - sx * sx));
}

TEST_F(Accuracy, writes_a_table_and_a_page_that_agree) {
  const ProgramOutcome outcome = run({"accuracy", "scene.toml", "-o", "out", "--repeat", "2", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  const std::vector<Row> rows = parse_csv(read_file(folder / "out/accuracy.csv"));
  ASSERT_EQ(rows.size(), json.at("runs").size());
  for (size_t i = 0; i < rows.size(); ++i) {
    const Json& run = json.at("runs")[i];
    EXPECT_EQ(rows[i].at("method"), run.at("method"));
    EXPECT_EQ(std::stod(rows[i].at("rmse")), run.at("rmse").get<double>());
    for (const char* column : {"bias", "max_abs", "q999", "relmse", "relative_rmse", "ssim", "flip",
                               "seconds_median", "seconds_min", "seconds_max", "render_seconds_median",
                               "density_samples", "shadow_samples", "leaps", "tolerance"}) {
      EXPECT_NO_THROW(std::stod(rows[i].at(column))) << column;
    }
    EXPECT_EQ(rows[i].at("step").empty(), rows[i].at("integrator") != "uniform");
    EXPECT_EQ(rows[i].at("estimate_max").empty(), rows[i].at("integrator") == "uniform");
  }

  const std::string manual = read_file(std::string(PILEUS_SOURCE_DIR) + "/docs/accuracy.md");
  for (const auto& [column, value] : rows.front()) {
    EXPECT_NE(manual.find("| `" + column + "` | "), std::string::npos) << column << " is not documented";
  }

  const std::string html = read_file(folder / "out/report.html");
  EXPECT_EQ(html.find("http"), std::string::npos) << "the page needs no network";
  EXPECT_EQ(html.find("{{"), std::string::npos) << "a marker was not filled in";
  EXPECT_NE(html.find("<img src=\"data:image/png;base64,iVBOR"), std::string::npos);
  const std::string sentence = json.at("conclusion");
  EXPECT_NE(html.find(sentence), std::string::npos);
  const std::string method = json.at("best");
  const double expected = cost_of_a_digit(rows, method);
  EXPECT_NEAR(json.at("cost_of_a_digit").get<double>(), expected, 1e-6 * expected);
  const std::string start = "On this scene, ten times more accurate costs ";
  ASSERT_EQ(sentence.find(start), 0u);
  EXPECT_NEAR(std::stod(sentence.substr(start.size())), expected, 0.006 * expected) << "three digits";
  EXPECT_NE(sentence.find("(" + method + ")"), std::string::npos);
}

TEST_F(Accuracy, draws_diagrams_where_gnuplot_is_there) {
  const ProgramOutcome with = run({"accuracy", "scene.toml", "-o", "with", "--repeat", "1"});
  ASSERT_EQ(with.exit_code, 0) << with.err;
  if (with.err.find("gnuplot is not installed") != std::string::npos) GTEST_SKIP() << with.err;
  const std::string html = read_file(folder / "with/report.html");
  for (const char* name : {"error_seconds", "error_lookups", "convergence_step", "convergence_tolerance"}) {
    EXPECT_NE(read_file(folder / "with" / (std::string(name) + ".svg")).find("<svg"), std::string::npos)
        << name;
    EXPECT_NE(html.find(name), std::string::npos) << name;
  }
}

TEST_F(Accuracy, does_without_gnuplot_and_says_so) {
  const ProgramOutcome outcome =
      run({"accuracy", "scene.toml", "-o", "out", "--repeat", "1", "--methods", "uniform"},
          {"PATH=/nonexistent"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.err.find("pileus: warning: gnuplot is not installed"), std::string::npos) << outcome.err;
  EXPECT_EQ(parse_csv(read_file(folder / "out/accuracy.csv")).size(), 6u);
  EXPECT_NE(read_file(folder / "out/report.html").find("gnuplot was not found"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder / "out/error_seconds.svg"));
}

TEST_F(Accuracy, measures_a_large_scene_small_and_says_so) {
  const std::vector<std::string> arguments{"accuracy", "scene.toml", "-o",    "out",          "--repeat",
                                           "1",        "--methods",  "exact", "--tolerances", "0.1"};
  const auto err_with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), arguments.begin(), arguments.end());
    const ProgramOutcome outcome = run(more);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.err;
  };
  std::string text = kSmallScene;
  text.replace(text.find("[24, 16]"), 8, "[960, 540]");
  write("scene.toml", text);
  EXPECT_EQ(err_with({}).find("pileus: measuring at 320x180 pixels instead of 960x540"), 0u);
  EXPECT_EQ(err_with({"--size", "32x20"}).find("measuring at"), std::string::npos);
  EXPECT_EQ(err_with({"--set", "render.size=[32, 20]"}).find("measuring at"), std::string::npos);
}

TEST_F(Accuracy, a_budget_is_answered_with_a_command_line) {
  const ProgramOutcome outcome = run({"accuracy", "scene.toml", "--budget", "50ms", "--repeat", "1", "--set",
                                      "volume.ball.extinction = 3", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json.at("budget_seconds"), 0.05);
  EXPECT_LE(json.at("seconds").get<double>(), 0.05);
  const std::string command = json.at("command");
  EXPECT_EQ(command.find("pileus render scene.toml -o scene.exr "), 0u) << command;
  EXPECT_NE(command.find("--set 'volume.ball.extinction = 3'"), std::string::npos) << command;
  EXPECT_EQ(folder.file_count(), 1u) << "nothing is written without -o";

  const std::string line = PILEUS_PROGRAM + command.substr(command.find(' '));
  EXPECT_EQ(std::system(("cd '" + folder.path().string() + "' && " + line + " --quiet").c_str()), 0) << line;
  EXPECT_TRUE(std::filesystem::exists(folder / "scene.exr"));
}

TEST_F(Accuracy, refuses_what_it_would_ignore) {
  const auto refusal = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"accuracy", "scene.toml"});
    const ProgramOutcome outcome = run(more);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(folder.file_count(), 1u);
    return outcome.err;
  };
  EXPECT_EQ(refusal({}), "pileus: error: no folder to write to; expected -o DIR, or --budget SECONDS\n");
  EXPECT_NE(
      refusal({"-o", "out", "--set", "render.tolerance=0.1"}).find("render.tolerance is what is varied"),
      std::string::npos);
  EXPECT_NE(refusal({"-o", "out", "--methods", "exakt"}).find("unknown method \"exakt\""), std::string::npos);
  EXPECT_NE(refusal({"--budget", "soon"}).find("expected a time, such as 0.5s"), std::string::npos);
  refusal({"-o", "out", "--tolerances", "0.1,-1"});
  refusal({"-o", "out", "--repeat", "0"});
}

TEST_F(Accuracy, fails_with_1_where_nothing_is_fast_enough_or_the_folder_is_none) {
  const ProgramOutcome late = run({"accuracy", "scene.toml", "--budget", "1e-9", "--repeat", "1"});
  EXPECT_EQ(late.exit_code, 1);
  EXPECT_EQ(late.err.find("pileus: error: 1e-09 s are too short"), 0u) << late.err;
  const ProgramOutcome no_folder = run({"accuracy", "scene.toml", "-o", "scene.toml"});
  EXPECT_EQ(no_folder.exit_code, 1);
  EXPECT_EQ(read_file(folder / "scene.toml"), kSmallScene);
}

TEST_F(Accuracy, an_interrupt_ends_it_and_leaves_no_table) {
  Program program({"accuracy", "scene.toml", "-o", "out", "--size", "2400x1600", "--tolerances", "1e-6"},
                  {folder.path(), {}, 0});
  program.wait_until_it_handles(SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  ASSERT_TRUE(program.is_running()) << "the study is too short for this test";
  program.send(SIGINT);
  const ProgramOutcome outcome = program.wait(20.0);
  EXPECT_EQ(outcome.exit_code, 130);
  EXPECT_EQ(outcome.err, "pileus: error: interrupted\n");
  EXPECT_FALSE(std::filesystem::exists(folder / "out/accuracy.csv"));
  EXPECT_FALSE(std::filesystem::exists(folder / "out/report.html"));
}

}  // namespace
}  // namespace pileus
