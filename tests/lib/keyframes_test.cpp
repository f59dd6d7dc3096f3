#include "lib/scene/keyframes.h"

#include <algorithm>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "lib/scene/animation.h"
#include "tests/fixtures/temp_folder.h"

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

TEST(Keyframes, smooth_ones_rest_at_the_ends_and_never_overshoot) {
  const std::string text =
      "x = { times = [0, 4, 5, 10, 12], values = [0, 1, 8, 8, -3], interpolation = \"smooth\" }";
  const auto x = [&](double frame) { return *at_frame(text, frame)["x"].value<double>(); };
  const double keys[][2] = {{0, 0}, {4, 1}, {5, 8}, {10, 8}, {12, -3}};
  for (const auto& [time, value] : keys) EXPECT_EQ(x(time), value) << time;
  const double h = 1e-5;
  EXPECT_NEAR((x(h) - x(0)) / h, 0.0, 1e-4) << "starts at rest";
  EXPECT_NEAR((x(12) - x(12 - h)) / h, 0.0, 1e-3) << "ends at rest";
  EXPECT_GT((x(4 + h) - x(4)) / h, 0.2) << "goes through a key on its way";
  for (const double time : {4.0, 5.0, 10.0}) {
    EXPECT_NEAR((x(time + h) - x(time)) / h, (x(time) - x(time - h)) / h, 1e-2)
        << "no jump of speed at " << time;
  }
  for (size_t k = 0; k + 1 < std::size(keys); ++k) {
    const double lo = std::min(keys[k][1], keys[k + 1][1]), hi = std::max(keys[k][1], keys[k + 1][1]);
    for (int n = 1; n < 40; ++n) {
      const double v = x(keys[k][0] + (keys[k + 1][0] - keys[k][0]) * n / 40);
      EXPECT_TRUE(v >= lo && v <= hi) << v << " is not within " << lo << ", " << hi;
    }
  }
  EXPECT_EQ(*at_frame("x = { times = [0, 2], values = [1, 3], interpolation = \"smooth\" }", 0.5)["x"]
                 .value<double>(),
            1.0 + 2.0 * 0.15625)
      << "two keys: 3 s^2 - 2 s^3";
  EXPECT_EQ(at_frame("x = { times = [0, 2], values = [1, 3], interpolation = \"linear\" }", 0.5)["x"]
                .value<double>(),
            1.5);
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

TEST(Keyframes, refuse_unknown_interpolations) {
  EXPECT_EQ(
      problem("x = { times = [1, 2], values = [1, 2], interpolation = \"smoot\" }"),
      "scene.toml:1:56: error: keyframes: interpolation = \"smoot\"; expected \"linear\" or \"smooth\"; "
      "nearest: smooth");
  EXPECT_EQ(problem("x = { times = [1, 2], values = [1, 2], interpolation = 3 }"),
            "scene.toml:1:56: error: keyframes: interpolation = 3; expected \"linear\" or \"smooth\"");
}

/// A scene in which everything moves that may: `at` gives the values of a key at frames 0 and 10.
std::string scene_of_moves(const std::function<std::string(const std::string&, const std::string&)>& at) {
  return "pileus = 1\n[camera]\ntype = \"perspective\"\nposition = " + at("[0.5, 0, 8]", "[1.5, 2, 9]") +
         "\nfov_deg = " + at("30.5", "50.5") +
         "\n[light.sun]\ntype = \"sun\"\ndirection = " + at("[0.5, 1, 0]", "[1.5, 1, 0]") +
         "\nirradiance = " + at("[1.5, 1, 1]", "[2.5, 3, 3]") +
         "\n[light.lamp]\ntype = \"point\"\nposition = " + at("[0.5, 1, 0]", "[1.5, 1, 0]") +
         "\n[freeform.a]\nbase = { sphere = { radius = " + at("1.25", "2.25") +
         " } }\nplace = { scale = " + at("[1.5, 1, 1]", "[2.5, 1, 1]") +
         ", rotate_deg = " + at("[0.5, 0, -350]", "[90.5, 0, 10]") +
         ", translate = " + at("[0.5, 0, 0]", "[2.5, 0, 0]") +
         " }\n[freeform.b]\nbase = { ellipsoid = { radii = [1, 2, 3] } }\n[freeform.m]\n"
         "morph = { from = \"a\", to = \"b\", beta = " +
         at("0.25", "0.75") +
         " }\n[object.m]\ntype = \"freeform\"\nform = \"m\"\n[object.s]\ntype = \"sphere\"\ncenter = " +
         at("[0.5, 0, 0]", "[2.5, 0, 0]") +
         "\n[volume.c]\ntype = \"cloud\"\nbounds = \"m\"\nvoxel_size = " + at("0.25", "0.5") +
         "\nerosion = " + at("0.125", "0.25") + "\nextinction = " + at("2.5", "4.5") +
         "\nnoise = { offset = " + at("[0.5, 0, 0]", "[2.5, 0, 0]") + ", evolution = " + at("0.5", "1") +
         " }\nphase = { type = \"hg\", g = " + at("0.25", "0.75") + " }\n";
}

TEST(Keyframes, move_cameras_lights_transforms_morphs_and_clouds) {
  const std::string moving = scene_of_moves([](const std::string& from, const std::string& to) {
    return "{ times = [0, 10], values = [" + from + ", " + to + "] }";
  });
  const std::string first = scene_of_moves([](const std::string& from, const std::string&) { return from; });
  const std::string last = scene_of_moves([](const std::string&, const std::string& to) { return to; });
  EXPECT_EQ(parse_scene(moving, "s.toml", ".", {}, 0).hash, parse_scene(first, "s.toml", ".").hash);
  EXPECT_EQ(parse_scene(moving, "s.toml", ".", {}, 10).hash, parse_scene(last, "s.toml", ".").hash);
  const Scene half = parse_scene(moving, "s.toml", ".", {}, 5);
  EXPECT_NE(half.hash, parse_scene(first, "s.toml", ".").hash);
  // A ball of radius 1.75, twice as long along x, turned by 45.5 degrees about x and -170 about z, half a
  // beta away from an ellipsoid: the value at one point tells all.
  const std::string middle = scene_of_moves([](const std::string& from, const std::string& to) {
    toml::table both = toml::parse("from = " + from + "\nto = " + to);
    const auto mean = [](const toml::node& a, const toml::node& b) {
      return 0.5 * (*a.value<double>() + *b.value<double>());
    };
    if (!both["from"].is_array()) return fmt::format("{:#.17g}", mean(*both.get("from"), *both.get("to")));
    std::string text;
    for (size_t i = 0; i < 3; ++i) {
      text += fmt::format("{}{:#.17g}", i ? ", " : "[",
                          mean(*both["from"].as_array()->get(i), *both["to"].as_array()->get(i)));
    }
    return text + "]";
  });
  const Scene written = parse_scene(middle, "s.toml", ".");
  for (const Vec3d& p : {Vec3d(0.3, 1.1, -0.7), Vec3d(2.0, 0.4, 0.9), Vec3d(-1.0, -1.5, 0.2)}) {
    EXPECT_EQ(half.freeforms.at("m").value(p), written.freeforms.at("m").value(p));
  }
  EXPECT_EQ(half.camera->camera_from_world(), written.camera->camera_from_world());
  EXPECT_EQ(half.volumes[0].object->extinction, written.volumes[0].object->extinction);
}

TEST(Keyframes, the_hash_follows_morphs_that_know_the_time) {
  const std::string text =
      "pileus = 1\ncamera = \"perspective\"\n[freeform.a]\nbase = { sphere = { radius = 1 } }\n"
      "[freeform.m]\nmorph = { from = \"a\", to = \"a\", beta_over_time = [[0, 0], [9, 1]] }\n";
  EXPECT_NE(parse_scene(text, "s.toml", ".", {}, 3).hash, parse_scene(text, "s.toml", ".", {}, 4).hash);
}

TEST(Keyframes, volumes_have_the_same_key_where_nothing_in_them_moves) {
  const TempFolder folder;
  const std::filesystem::path file = folder / "s.toml";
  std::ofstream(file)
      << "pileus = 1\n[camera]\ntype = \"perspective\"\nfov_deg = { times = [0, 9], values = [30, 60] }\n"
         "[freeform.still]\nbase = { sphere = { radius = 1 } }\n"
         "[freeform.moving]\nbase = { sphere = { radius = { times = [0, 9], values = [1, 2] } } }\n"
         "[freeform.timed]\nmorph = { from = \"still\", to = \"still\", beta_over_time = [[0, 0], [9, 1]] }\n"
         "[freeform.both]\nunion = [\"still\", \"moving\"]\n"
         "[volume.still]\ntype = \"cloud\"\nbounds = \"still\"\n"
         "[volume.moving]\ntype = \"cloud\"\nbounds = \"both\"\n"
         "[volume.timed]\ntype = \"cloud\"\nbounds = \"timed\"\n"
         "[volume.boiling]\ntype = \"cloud\"\nbounds = \"still\"\n"
         "noise = { evolution = { times = [0, 9], values = [0, 1] } }\n";
  const auto at_3 = volume_keys(file, {}, 3), at_4 = volume_keys(file, {}, 4);
  EXPECT_EQ(at_3.at("still"), at_4.at("still"));
  for (const char* name : {"moving", "timed", "boiling"}) EXPECT_NE(at_3.at(name), at_4.at(name)) << name;
  EXPECT_NE(at_3.at("still"), volume_keys(file, {"volume.still.voxel_size=0.5"}, 3).at("still"));
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
