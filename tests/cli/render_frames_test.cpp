// `pileus render --frames`: names, lists, errors, reports, and going on after an interruption.
#include <chrono>
#include <csignal>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "lib/image/image_io.h"
#include "tests/cli/program.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// kSmallScene with a camera and a density that change.
std::string moving_scene() {
  std::string text = kSmallScene;
  text.replace(text.find("type = \"perspective\""), 20,
               "type = \"perspective\"\n"
               "position = { times = [1, 9], values = [[0, 0, 5], [1, 0, 6]], interpolation = \"smooth\" }");
  text.replace(text.find("extinction = 2"), 14, "extinction = { times = [1, 9], values = [2, 4] }");
  return text;
}

struct RenderFrames : testing::Test, ProgramTest {
  /// Of what a quick run prints.
  std::string output(const std::vector<std::string>& arguments) const {
    const ProgramOutcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  }

  std::string error(const std::vector<std::string>& arguments) const {
    const ProgramOutcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.out;
    return outcome.err;
  }
};

bool have_equal_pixels(const Image& a, const Image& b) {
  if (a.channels.size() != b.channels.size()) return false;
  for (size_t c = 0; c < a.channels.size(); ++c) {
    if (a.channels[c].values != b.channels[c].values) return false;
  }
  return true;
}

TEST_F(RenderFrames, are_the_pictures_of_their_frames) {
  write("scene.toml", moving_scene());
  const std::string told = output({"render", "scene.toml", "--frames", "1,4-8x4", "-o", "a.%04d.exr", "-o",
                                   "a.%d.png", "--report", "a.json"});
  EXPECT_EQ(told.find("a.0001.exr: 24 x 16 pixels in "), 0u) << told;
  EXPECT_EQ(folder.file_count(), 8u);
  for (const int frame : {1, 4, 8}) {
    EXPECT_TRUE(fs::exists(folder / ("a." + std::to_string(frame) + ".png")));
    output({"render", "scene.toml", "--frame", std::to_string(frame), "-o", "still.exr"});
    EXPECT_TRUE(have_equal_pixels(read_image(folder / "still.exr"),
                                  read_image(folder / ("a.000" + std::to_string(frame) + ".exr"))))
        << frame;
  }
  EXPECT_FALSE(have_equal_pixels(read_image(folder / "a.0004.exr"), read_image(folder / "a.0008.exr")));
}

TEST_F(RenderFrames, have_one_report) {
  write("scene.toml", moving_scene());
  const std::string told =
      output({"render", "scene.toml", "--frames", "2-3", "-o", "a.%d.exr", "--report", "a.json", "--json"});
  const Json report = Json::parse(told);
  EXPECT_EQ(report, Json::parse(read_file(folder / "a.json")));
  EXPECT_EQ(report.at("frames_left"), 0);
  ASSERT_EQ(report.at("frames").size(), 2u);
  EXPECT_EQ(report.at("frames")[1].at("frame"), 3);
  EXPECT_EQ(report.at("frames")[1].at("outputs"), Json({"a.3.exr"}));
  EXPECT_EQ(report.at("frames")[1].at("skipped"), false);
  EXPECT_EQ(report.at("frames")[1].at("report").at("pixels"), 24 * 16);
}

TEST_F(RenderFrames, without_an_output_get_the_name_of_the_scene) {
  write("scene.toml", moving_scene());
  output({"render", "scene.toml", "--frames", "7"});
  EXPECT_TRUE(fs::exists(folder / "scene.0007.png"));
}

TEST_F(RenderFrames, refuse_names_and_lists_that_cannot_be) {
  write("scene.toml", moving_scene());
  EXPECT_EQ(error({"render", "scene.toml", "--frames", "1-3", "-o", "a.exr"}),
            "a.exr: error: has no place for the number of a frame; expected one such as frame.%04d.exr\n");
  EXPECT_EQ(error({"render", "scene.toml", "-o", "a.%04d.exr"}),
            "a.%04d.exr: error: names a sequence of files; expected --frames FIRST-LAST, such as --frames "
            "1-48\n");
  for (const std::string frames : {"3-1", "a", "1,", "1-3x0", "1;2"}) {
    EXPECT_EQ(
        error({"render", "scene.toml", "--frames=" + frames, "-o", "a.%d.exr"}),
        "pileus: error: --frames " + frames +
            "; expected FIRST-LAST, such as 1-48, 1-48x4 for every fourth, or a list of such, 1,4,10-20\n");
  }
  EXPECT_EQ(error({"render", "scene.toml", "--frames", "1-3,2", "-o", "a.%d.exr"}),
            "pileus: error: --frames 1-3,2 names frame 2 twice\n");
  EXPECT_EQ(
      error({"render", "cloud.vdb", "--frames", "1-3", "-o", "a.%d.exr"}),
      "cloud.vdb: error: does not change from frame to frame; --frames expects a scene (.toml), or volumes "
      "with a place for the number, such as smoke.%04d.vdb\n");
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST_F(RenderFrames, may_be_numbered_volumes) {
  for (const int frame : {1, 2, 3}) {
    const std::string raw = "a." + std::to_string(frame) + ".raw";
    write(raw, std::string(8, char(frame)));
    write(raw + ".json", R"({"pileus_volume": 1, "type": "uint8", "size": [2, 2, 2], "grid": "density"})");
  }
  output({"convert", "a.%d.raw", "a.%04d.vdb", "--frames", "1-3"});
  const std::vector<std::string> arguments{"render", "a.%04d.vdb", "--frames", "1-3",
                                           "-o",     "a.%d.exr",   "--size",   "16x16"};
  output(arguments);
  const Image first = read_image(folder / "a.1.exr"), last = read_image(folder / "a.3.exr");
  EXPECT_FALSE(have_equal_pixels(first, last)) << "each frame has a file of its own";
  output({"render", "a.0003.vdb", "-o", "still.exr", "--size", "16x16"});
  EXPECT_TRUE(have_equal_pixels(read_image(folder / "still.exr"), last));

  fs::remove(folder / "a.2.exr");
  std::vector<std::string> again = arguments;
  again.push_back("--resume");
  const std::string told = output(again);
  EXPECT_EQ(told.find("a.1.exr: is there\na.2.exr: 16 x 16 pixels in "), 0u) << told;
  EXPECT_NE(told.find("a.3.exr: is there\n"), std::string::npos) << told;

  output({"render", "a.%04d.vdb", "--frames", "2", "--size", "16x16"});
  EXPECT_TRUE(fs::exists(folder / "a.0002.png"));
  EXPECT_EQ(error({"render", "a.%04d.vdb", "-o", "b.png"}),
            "a.%04d.vdb: error: names a sequence of files; expected --frames FIRST-LAST, such as --frames "
            "1-48\n");
  fs::remove(folder / "a.0001.vdb");
  const ProgramOutcome missing = run({"render", "a.%04d.vdb", "--frames", "1-3", "-o", "b.%d.exr"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_EQ(missing.err, "a.0001.vdb: error: frame 1: no such file\n");
  EXPECT_FALSE(fs::exists(folder / "b.1.exr"));
}

TEST_F(RenderFrames, name_the_frame_of_an_error_before_any_is_rendered) {
  std::string text = moving_scene();
  text += "albedo = { times = [1, 3], values = [[1, 1, 1], [1, 1, 1.5]] }\n";
  write("scene.toml", text);
  const std::string complaint = error({"render", "scene.toml", "--frames", "1-3", "-o", "a.%d.exr"});
  EXPECT_NE(complaint.find("error: frame 2: volume \"ball\": albedo"), std::string::npos) << complaint;
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST_F(RenderFrames, that_are_whole_and_of_the_same_are_left_alone) {
  write("scene.toml", moving_scene());
  const std::vector<std::string> arguments{"render",   "scene.toml", "--frames", "1-3",     "-o",
                                           "a.%d.exr", "-o",         "a.%d.png", "--resume"};
  output(arguments);
  const std::string exr = read_file(folder / "a.2.exr"), png = read_file(folder / "a.3.png");
  EXPECT_EQ(output(arguments),
            "a.1.exr: is there\na.1.png: is there\na.2.exr: is there\na.2.png: is there\n"
            "a.3.exr: is there\na.3.png: is there\n");
  // Cut off, and of bytes that are others: rendered again, to the same.
  write("a.2.exr", exr.substr(0, exr.size() / 2));
  write("a.3.png", png.substr(0, png.size() - 40));
  const std::string told = output(arguments);
  EXPECT_EQ(told.find("a.1.exr: is there\na.1.png: is there\na.2.exr: 24 x 16 pixels"), 0u) << told;
  EXPECT_NE(told.find("a.3.png: 24 x 16 pixels"), std::string::npos) << told;
  EXPECT_EQ(read_file(folder / "a.2.exr"), exr);
  EXPECT_EQ(read_file(folder / "a.3.png"), png);
  // Of other settings: rendered again.
  std::vector<std::string> others = arguments;
  others.insert(others.end(), {"--set", "volume.ball.emission=[1, 1, 1]"});
  EXPECT_EQ(output(others).find("is there"), std::string::npos);
  EXPECT_NE(read_file(folder / "a.2.exr"), exr);
}

/// Starts a sequence of frames that take a while, and sends the signal when the first is there.
ProgramOutcome stopped(const ProgramTest& test, const std::vector<std::string>& arguments, int signal) {
  Program program(arguments, {test.folder.path(), {}, 0});
  while (program.is_running() && !fs::exists(test.folder / "a.1.exr")) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  program.send(signal);
  return program.wait(20.0);
}

TEST_F(RenderFrames, go_on_after_an_interruption_and_a_kill_to_the_same_bits) {
  std::string text = moving_scene();
  text.replace(text.find("[24, 16]"), 8, "[150, 100]\ntolerance = 0\naovs = \"beauty,Z,error_estimate\"");
  write("scene.toml", text);
  const std::vector<std::string> arguments{"render",   "scene.toml", "--frames",  "1-3",
                                           "-o",       "a.%d.exr",   "-o",        "a.%d.png",
                                           "--report", "a.json",     "--threads", "2"};
  std::vector<std::string> again = arguments;
  again.push_back("--resume");
  const ProgramOutcome interrupted = stopped(*this, arguments, SIGINT);
  ASSERT_EQ(interrupted.exit_code, 130);
  EXPECT_NE(interrupted.err.find(": interrupted"), std::string::npos) << interrupted.err;
  EXPECT_TRUE(fs::exists(folder / "a.1.png"));
  EXPECT_FALSE(fs::exists(folder / "a.3.exr"));

  EXPECT_EQ(stopped(*this, again, SIGKILL).exit_code, -1);
  const std::string told = output(again);
  EXPECT_EQ(told.find("a.1.exr: is there\n"), 0u) << told;
  EXPECT_FALSE(fs::exists(folder / "a.2.exr.partial.exr") || fs::exists(folder / "a.3.exr.partial.exr"));
  std::vector<std::string> whole = arguments;
  for (std::string& argument : whole) {
    if (argument[0] == 'a' && argument[1] == '.') argument[0] = 'b';
  }
  output(whole);
  for (const char* name : {"1.exr", "2.exr", "3.exr", "1.png", "2.png", "3.png"}) {
    EXPECT_EQ(read_file(folder / (std::string("a.") + name)), read_file(folder / (std::string("b.") + name)))
        << name;
  }
}

TEST_F(RenderFrames, leave_a_checkpoint_that_is_taken_up) {
  std::string text = moving_scene();
  text.replace(text.find("[24, 16]"), 8, "[480, 320]\ntolerance = 0");
  write("scene.toml", text);
  const std::vector<std::string> arguments{"render", "scene.toml", "--frames", "1-2", "-o", "a.%d.exr"};
  // Machines differ: later and later, until it is amid the first frame.
  ProgramOutcome outcome;
  for (int milliseconds = 100; milliseconds < 10000 && !fs::exists(folder / "a.1.exr.partial.exr");
       milliseconds = milliseconds * 3 / 2) {
    Program program(arguments, {folder.path(), {}, 0});
    program.wait_until_it_handles(SIGINT);
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
    program.send(SIGINT);
    outcome = program.wait(20.0);
    ASSERT_EQ(outcome.exit_code, 130);
  }
  ASSERT_TRUE(fs::exists(folder / "a.1.exr.partial.exr"));
  EXPECT_EQ(outcome.err, "pileus: error: frame 1: interrupted\n");
  // Without --resume it is thrown away, with it a damaged one is told: so it is read.
  write("a.1.exr.partial.exr", "no picture");
  const ProgramOutcome damaged =
      run({"render", "scene.toml", "--frames", "1-2", "-o", "a.%d.exr", "--resume"});
  EXPECT_EQ(damaged.err.find("a.1.exr.partial.exr: error: frame 1: "), 0u) << damaged.err;
}

}  // namespace
}  // namespace pileus
