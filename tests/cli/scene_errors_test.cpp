// Invalid scenes through the program: every error with its place, the line of the file and a caret.
#include <gtest/gtest.h>

#include "tests/cli/program.h"

namespace pileus {
namespace {

struct SceneErrors : testing::Test, ProgramTest {
  /// What the program says about a scene; it must refuse it with exit code 2.
  std::string complaints(const std::string& text) const {
    const ProgramOutcome outcome = run({"render", write("scene.toml", text), "-o", "a.png"});
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(folder.file_count(), 1u) << "something was written";
    return outcome.err;
  }
};

TEST_F(SceneErrors, broken_toml_is_shown_where_it_breaks) {
  EXPECT_EQ(complaints("pileus = 1\n[camera\n"),
            "scene.toml:2:8: error: Error while parsing table header: expected ']', saw '\\n'\n"
            "  [camera\n"
            "         ^\n");
  EXPECT_EQ(complaints("").find("scene.toml:1:1: error: no version; a scene starts with `pileus = 1`\n"), 0u);
}

TEST_F(SceneErrors, one_run_reports_them_all_in_the_order_of_the_file) {
  EXPECT_EQ(
      complaints(R"(pileus = 1
[camera]
type = "perspective"
fov_dge = 30
[light.sun]
type = "sun"
irradiance = [-1, 0, 0]
[volume.a]
type = "elipsoid"
[volume.b]
type = "box"
	phase = { type = "hg", g = 1.5 }
[volume.c]
type = "cloud"
bounds = "blub"
voxel_size = 0.1
[freeform.blob]
base = { ellipsoid = { center = [0, 1], radii = [1, 1, 1] } }
[rendr]
)"),
      R"(scene.toml:4:1: error: camera: unknown parameter "fov_dge"; expected type, position, look_at, up or fov_deg; nearest: fov_deg
  fov_dge = 30
  ^
scene.toml:7:15: error: light "sun": irradiance = -1 is out of range; expected >= 0
  irradiance = [-1, 0, 0]
                ^
scene.toml:9:8: error: volume "a": unknown volume type "elipsoid"; expected box, cloud, ellipsoid, height_fog, instance or vdb; nearest: ellipsoid
  type = "elipsoid"
         ^
scene.toml:12:29: error: volume "b": phase: g = 1.5 is out of range; expected -1 < g < 1
   phase = { type = "hg", g = 1.5 }
                              ^
scene.toml:15:10: error: volume "c": there is no freeform "blub"; the scene has blob; nearest: blob
  bounds = "blub"
           ^
scene.toml:18:33: error: freeform "blob": base: ellipsoid: center = an array of 2; expected [number, number, number]
  base = { ellipsoid = { center = [0, 1], radii = [1, 1, 1] } }
                                  ^
scene.toml:19:2: error: unknown section "rendr"; expected pileus, render, display, camera, background, light, volume, object, fog, texture or freeform; nearest: render
  [rendr]
   ^
)");
}

TEST_F(SceneErrors, a_file_of_the_scene_that_is_missing_is_named_with_its_volume) {
  const std::string scene =
      std::string(kSmallScene) + "[volume.smoke]\ntype = \"vdb\"\nfile = \"smoke.vdb\"\n";
  const ProgramOutcome outcome = run({"render", write("scene.toml", scene), "-o", "a.png"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err, "smoke.vdb: error: volume \"smoke\": no such file\n");
}

TEST_F(SceneErrors, nothing_in_a_file_reaches_the_terminal_as_a_command) {
  const std::string text = complaints("pileus = 1\n[camera]\ntype = \"\\u001b[31mred\"\n");
  EXPECT_EQ(text.find('\x1b'), std::string::npos) << text;
  EXPECT_EQ(complaints("pileus = 1 # \x1b[31m\n").find('\x1b'), std::string::npos);
}

TEST_F(SceneErrors, long_lines_are_shown_around_the_place) {
  const std::string filler(5000, ' ');
  const std::string text =
      complaints("pileus = 1\ncamera = {" + filler + "type = \"perspectiv\"," + " up = [0, 1, 0]}\n");
  EXPECT_NE(text.find("type = \"perspectiv\""), std::string::npos);
  EXPECT_LT(text.size(), 600u);
}

// What a hostile file may try: depth, size, bytes that are no text.
TEST_F(SceneErrors, hostile_text_is_refused_and_crashes_nothing) {
  const auto times = [](size_t count, const std::string& text) {
    std::string result;
    for (size_t i = 0; i < count; ++i) result += text;
    return result;
  };
  std::string all_bytes;
  for (int byte = 0; byte < 256; ++byte) all_bytes += char(byte);
  const std::string texts[] = {
      "a = " + times(100000, "[") + times(100000, "]"),
      "a = " + times(100000, "{a=") + "1" + times(100000, "}"),
      times(3000000, "a.") + "b = 1",
      "[" + times(3000000, "a.") + "b]",
      times(1000000, "\"=\".") + "b = 1",
      "[" + times(1000000, "'#'.") + "b]",
      std::string("pileus = 1\n\0\n", 13),
      "pileus = 1\na = \"\xff\xfe\"\n",
      all_bytes,
      "pileus = 99999999999999999999999999",
      "pileus = 1\npileus = 1",
      "pileus = 1.0",
      "pileus = \"\"\"",
      "\xff\xfep\0i\0",
  };
  for (const std::string& text : texts) {
    const std::string complaint = complaints(text);
    EXPECT_EQ(complaint.find("scene.toml:"), 0u) << complaint.substr(0, 300);
    EXPECT_LT(complaint.size(), 2000u);
  }
  EXPECT_EQ(complaints("pileus = 1\n  " + times(100, "a.") + "b = 1").substr(0, 57),
            "scene.toml:2:130: error: a key has more than 64 parts\n  .");
}

}  // namespace
}  // namespace pileus
