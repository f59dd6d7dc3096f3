#include "lib/scene/keyframes.h"

#include <string>

#include <gtest/gtest.h>

#include "lib/scene/animation.h"

namespace pileus {
namespace {

toml::table at_frame(const std::string& text, double frame) {
  toml::table root = toml::parse(text, std::string("scene.toml"));
  const std::vector<Diagnostic> problems = resolve_keyframes(root, frame, "scene.toml");
  EXPECT_TRUE(problems.empty()) << to_string(problems.front());
  return root;
}

std::string problem(const std::string& text) {
  toml::table root = toml::parse(text, std::string("scene.toml"));
  const std::vector<Diagnostic> problems = resolve_keyframes(root, 1, "scene.toml");
  return problems.empty() ? "" : to_string(problems.front());
}

TEST(Keyframes, interpolate_numbers_between_times) {
  const std::string text = "x = { times = [1, 11, 21], values = [0, 5.0, -5] }";
  EXPECT_EQ(at_frame(text, 1)["x"].value<double>(), 0.0);
  EXPECT_EQ(at_frame(text, 6)["x"].value<double>(), 2.5);
  EXPECT_EQ(at_frame(text, 11)["x"].value<double>(), 5.0);
  EXPECT_EQ(at_frame(text, 13.5)["x"].value<double>(), 2.5);
}

TEST(Keyframes, stay_before_the_first_and_after_the_last) {
  const std::string text = "x = { times = [1, 11], values = [3, 4] }";
  EXPECT_EQ(at_frame(text, -100)["x"].value<double>(), 3.0);
  EXPECT_EQ(at_frame(text, 11)["x"].value<double>(), 4.0);
  EXPECT_EQ(at_frame(text, 1e9)["x"].value<double>(), 4.0);
  EXPECT_TRUE(at_frame(text, 0)["x"].is_integer()) << "what needs an integer still gets one at a key";
}

TEST(Keyframes, go_into_arrays_and_tables_and_out_of_arrays) {
  const toml::table root = at_frame(
      "[a.b]\nv = { times = [0, 2], values = [[0, 1, 2], [4, 1, 0]] }\n"
      "list = [ { f = { times = [0, 4], values = [1, 2] } }, { times = [0, 2], values = [10, 20] } ]",
      1);
  EXPECT_EQ(root["a"]["b"]["v"][0].value<double>(), 2.0);
  EXPECT_EQ(root["a"]["b"]["v"][1].value<double>(), 1.0);
  EXPECT_EQ(root["a"]["b"]["v"][2].value<double>(), 1.0);
  EXPECT_EQ(root["a"]["b"]["list"][0]["f"].value<double>(), 1.25);
  EXPECT_EQ(root["a"]["b"]["list"][1].value<double>(), 15.0);
}

TEST(Keyframes, leave_other_tables_alone) {
  const toml::table root = at_frame("x = { times = [1], values = [1], more = 1 }\ny = { times = [1] }", 1);
  EXPECT_TRUE(root["x"].is_table());
  EXPECT_TRUE(root["y"].is_table());
}

TEST(Keyframes, keep_their_place_for_messages) {
  const toml::table root = at_frame("\n\nabc = 1\nx = { times = [0, 2], values = [  3, 4] }", 1);
  const toml::node* const x = root.get("x");
  EXPECT_EQ(x->source().begin.line, 4u);
  EXPECT_EQ(x->source().begin.column, 35u);
}

TEST(Keyframes, tell_what_is_wrong_and_where) {
  EXPECT_EQ(problem("x = { times = 3, values = [1] }"),
            "scene.toml:1:15: error: keyframes: times = 3; expected a list of at least one frame");
  EXPECT_EQ(
      problem("x = { times = [], values = [] }"),
      "scene.toml:1:15: error: keyframes: times = an array of 0; expected a list of at least one frame");
  EXPECT_EQ(
      problem("x = { times = [1, 2], values = [1] }"),
      "scene.toml:1:32: error: keyframes: values = an array of 1; expected an array of 2: one for each time");
  EXPECT_EQ(problem("x = { times = [2, 2], values = [1, 1] }"),
            "scene.toml:1:19: error: keyframes: 2 among times; expected numbers that rise");
  EXPECT_EQ(
      problem("x = { times = [1, 2], values = [[1, 2], [1]] }"),
      "scene.toml:1:41: error: keyframes: an array of 1 among values; expected numbers, or arrays of numbers "
      "of one shape");
  EXPECT_EQ(
      problem("x = { times = [1, 2], values = [\"a\", \"b\"] }"),
      "scene.toml:1:33: error: keyframes: \"a\" among values; expected numbers, or arrays of numbers of one "
      "shape");
}

TEST(Keyframes, a_scene_is_read_at_a_frame) {
  const std::string text =
      "pileus = 1\n[camera]\ntype = \"perspective\"\nfov_deg = { times = [0, 10], values = [30, 50] }\n"
      "[display]\nexposure = { times = [0, 10], values = [0, 1] }\n";
  EXPECT_EQ(parse_scene(text, "s.toml", ".").display.exposure_stops, 0.0);
  EXPECT_EQ(parse_scene(text, "s.toml", ".", {}, 5).display.exposure_stops, 0.5);
  EXPECT_NE(parse_scene(text, "s.toml", ".", {}, 5).hash, parse_scene(text, "s.toml", ".").hash);
  try {
    parse_scene(text + "gamma = { times = [0, 10], values = [-1, -2] }\n", "s.toml", ".", {}, 5);
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find("s.toml:7:38: error: display: gamma = -1.5 is out of range"), 0u)
        << error.what();
  }
}

}  // namespace
}  // namespace pileus
