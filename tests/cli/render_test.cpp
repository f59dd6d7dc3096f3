// `pileus render`: reports, silence, interruption, resumption, damaged volumes.
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

/// kSmallScene, larger and as exact as can be.
std::string slow_scene(int width, int height) {
  std::string text = kSmallScene;
  text.replace(text.find("[24, 16]"), 8, "[" + std::to_string(width) + ", " + std::to_string(height) + "]");
  text.replace(text.find("[camera]"), 0, "tolerance = 0\naovs = \"beauty,Z,error_estimate\"\n");
  return text;
}

struct Render : testing::Test, ProgramTest {};

TEST_F(Render, the_report_has_every_figure) {
  write("scene.toml", kSmallScene);
  const ProgramOutcome outcome = run({"render", "scene.toml", "-o", "a.exr", "-o", "a.png", "--report",
                                      "a.json", "--json", "--threads", "2"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(outcome.out, read_file(folder / "a.json"));
  const Json report = Json::parse(outcome.out);
  for (const char* key :
       {"version", "scene", "integrator", "tolerance", "threads", "seconds", "peak_memory_bytes", "pixels",
        "rays", "counters", "effects", "error_bound", "nan_pixels", "warnings"}) {
    EXPECT_TRUE(report.contains(key)) << key;
  }
  for (const char* stage : {"wall", "cpu", "load", "build", "render", "write"}) {
    EXPECT_GE(report.at("seconds").at(stage).get<double>(), 0.0) << stage;
  }
  for (const char* key : {"density_samples", "shadow_samples", "leaps"}) {
    EXPECT_TRUE(report.at("counters").contains(key)) << key;
  }
  for (const auto& [name, effect] : report.at("effects").items()) {
    EXPECT_TRUE(effect.contains("on") && effect.contains("reason") && effect.contains("count")) << name;
    if (effect.at("count").is_number()) {
      EXPECT_EQ(effect.at("on").get<bool>(), effect.at("count") > 0) << name << ": what is off costs nothing";
    }
  }
  EXPECT_TRUE(report.at("error_bound").contains("max") && report.at("error_bound").contains("mean"));
  EXPECT_EQ(report.at("integrator"), "march");
  EXPECT_EQ(report.at("threads"), 2);
  EXPECT_EQ(report.at("pixels"), 24 * 16);
  EXPECT_EQ(report.at("rays"), 24 * 16);
  EXPECT_EQ(report.at("nan_pixels"), 0);
  EXPECT_LE(report.at("error_estimate").at("max").get<double>(), 0.002);
  EXPECT_TRUE(fs::exists(folder / "a.exr") && fs::exists(folder / "a.png"));
}

TEST_F(Render, the_report_is_json_whatever_the_files_are_called) {
  write("\xff.toml", kSmallScene);
  const ProgramOutcome outcome = run({"render", "\xff.toml", "-o", "a.exr", "--json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(Json::accept(outcome.out));
  EXPECT_TRUE(Json::accept(run({"explain", "\xff.toml", "--json"}).out));
}

TEST_F(Render, the_report_does_not_replace_the_scene) {
  write("scene.toml", kSmallScene);
  const ProgramOutcome outcome = run({"render", "scene.toml", "-o", "a.exr", "--report", "./scene.toml"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err, "./scene.toml: error: is the input; expected another name for the report\n");
  EXPECT_EQ(read_file(folder / "scene.toml"), kSmallScene);
}

TEST_F(Render, an_integrator_without_an_estimate_claims_none) {
  write("scene.toml", kSmallScene);
  const Json report =
      Json::parse(run({"render", "scene.toml", "-o", "a.exr", "--json", "--integrator", "uniform"}).out);
  EXPECT_TRUE(report.at("error_estimate").at("max").is_null());
  EXPECT_TRUE(report.at("error_bound").at("max").is_null());
}

TEST_F(Render, options_of_the_command_line_win_over_the_scene) {
  write("scene.toml", kSmallScene);
  const ProgramOutcome outcome =
      run({"render", "scene.toml", "-o", "a.exr", "--size", "40x30", "--crop", "8,9,28,19", "--tolerance",
           "0.5", "--seed", "7", "--aov", "beauty,Z,samples", "--set", "light.sun.irradiance=[0, 0, 9]"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out.find("a.exr: 20 x 10 pixels in "), 0u);
  const Image image = read_image(folder / "a.exr");
  EXPECT_EQ(image.width, 20);
  EXPECT_EQ(image.height, 10);
  for (const char* name : {"R", "G", "B", "A", "Z", "Z_half", "samples"})
    EXPECT_TRUE(image.find(name)) << name;
  EXPECT_EQ(image.find("R")->values[5 * 20 + 12], 0.0f);
  EXPECT_GT(image.find("B")->values[5 * 20 + 12], 0.0f);
}

TEST_F(Render, is_quiet_where_told_to_and_where_nobody_looks) {
  write("scene.toml", slow_scene(160, 90));
  const ProgramOutcome told = run({"render", "scene.toml", "-o", "a.png", "--quiet"});
  EXPECT_EQ(told.exit_code, 0);
  EXPECT_EQ(told.out + told.err, "");
  const ProgramOutcome piped = run({"render", "scene.toml", "-o", "b.png"});
  EXPECT_EQ(piped.err, "") << "no progress bar where stderr is no terminal";
  EXPECT_EQ(piped.out.find("b.png: 160 x 90 pixels in "), 0u);
}

TEST_F(Render, without_an_output_the_picture_gets_the_name_of_the_scene) {
  write("scene.toml", kSmallScene);
  EXPECT_EQ(run({"render", "scene.toml"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(folder / "scene.png"));
  EXPECT_EQ(folder.file_count(), 2u);
}

/// Starts a long render, interrupts it once it runs, and checks that it ends within a second.
ProgramOutcome interrupted(const ProgramTest& test, std::vector<std::string> arguments, int signal) {
  Program program(arguments, {test.folder.path(), {}, 0});
  program.wait_until_it_handles(signal);
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  EXPECT_TRUE(program.is_running()) << "the render is too short for this test";
  program.send(signal);
  const ProgramOutcome outcome = program.wait(20.0);
  EXPECT_EQ(outcome.exit_code, 130);
  EXPECT_LT(outcome.seconds, 1.0);
  return outcome;
}

TEST_F(Render, an_interrupted_render_leaves_nothing_behind) {
  write("scene.toml", slow_scene(2400, 1600));
  for (const int signal : {SIGINT, SIGTERM}) {
    EXPECT_EQ(interrupted(*this, {"render", "scene.toml", "-o", "a.exr", "--report", "a.json"}, signal).err,
              "pileus: error: interrupted\n");
    EXPECT_EQ(folder.file_count(), 1u);
  }
}

TEST_F(Render, a_second_interrupt_ends_what_does_not_hear_the_first) {
  write("scene.toml", kSmallScene);
  Program program(
      {"render", "scene.toml", "-o", "a.exr", "--set", "render.integrator={type=\"uniform\", step=1e-6}"},
      {folder.path(), {}, 0});
  program.wait_until_it_handles(SIGINT);
  for (int n = 0; n < 2; ++n) {
    std::this_thread::sleep_for(std::chrono::milliseconds(600));
    program.send(SIGINT);
  }
  const ProgramOutcome outcome = program.wait(20.0);
  EXPECT_EQ(outcome.exit_code, 130);
  EXPECT_LT(outcome.seconds, 1.0);
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST_F(Render, building_a_cloud_can_be_interrupted_too) {
  write("scene.toml", R"(pileus = 1
camera = "perspective"
[freeform.blob]
base = { ellipsoid = { center = [0, 0, 0], radii = [3, 2, 2] } }
[volume.cumulus]
type = "cloud"
bounds = "blob"
voxel_size = 0.004
max_voxels = 2000000000
noise = { octaves = 16 }
)");
  interrupted(*this, {"render", "scene.toml", "-o", "a.exr"}, SIGINT);
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST_F(Render, a_resumed_render_equals_one_that_was_never_interrupted) {
  write("scene.toml", slow_scene(480, 320));
  const std::vector<std::string> arguments{"render",   "scene.toml", "-o",        "a.exr", "--resume",
                                           "--report", "a.json",     "--threads", "2"};
  Program program(arguments, {folder.path(), {}, 0});
  program.wait_until_it_handles(SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  program.send(SIGINT);
  const ProgramOutcome outcome = program.wait(20.0);
  if (outcome.exit_code == 0) GTEST_SKIP() << "this machine is too fast for the scene";
  EXPECT_EQ(outcome.exit_code, 130);
  EXPECT_TRUE(fs::exists(folder / "a.exr.partial.exr"));
  EXPECT_FALSE(fs::exists(folder / "a.exr"));
  EXPECT_EQ(folder.file_count(), 2u);

  // A checkpoint of other settings is refused, and stays.
  std::vector<std::string> others = arguments;
  others.insert(others.end(), {"--set", "volume.ball.extinction=3"});
  EXPECT_EQ(
      run(others).err,
      "a.exr.partial.exr: error: is a checkpoint of another scene or other settings; remove it to start "
      "afresh\n");

  EXPECT_EQ(run(arguments).exit_code, 0);
  EXPECT_FALSE(fs::exists(folder / "a.exr.partial.exr"));
  EXPECT_EQ(run({"render", "scene.toml", "-o", "b.exr", "--report", "b.json", "--threads", "1"}).exit_code,
            0);
  EXPECT_EQ(read_file(folder / "a.exr"), read_file(folder / "b.exr"));
  const Json resumed = Json::parse(read_file(folder / "a.json")),
             whole = Json::parse(read_file(folder / "b.json"));
  EXPECT_EQ(resumed.at("error_estimate"), whole.at("error_estimate"));
}

TEST_F(Render, a_damaged_checkpoint_is_refused) {
  write("scene.toml", kSmallScene);
  write("a.exr.partial.exr", "no picture");
  const ProgramOutcome outcome = run({"render", "scene.toml", "-o", "a.exr", "--resume"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err.find("a.exr.partial.exr: error: "), 0u) << outcome.err;
  EXPECT_EQ(read_file(folder / "a.exr.partial.exr"), "no picture");
}

TEST_F(Render, damaged_volumes_get_one_clear_line_soon_and_in_little_memory) {
  const fs::path malformed = fs::path(PILEUS_DATA_DIR) / "malformed";
  if (!fs::exists(malformed)) GTEST_SKIP() << malformed << " is missing";
  for (const auto& file : fs::directory_iterator(malformed)) {
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"render", file.path(), "-o", "a.png"}, {"info", file.path()}}) {
      const ProgramOutcome outcome = run_program(arguments, {folder.path(), {}, size_t(4) << 30});
      EXPECT_TRUE(outcome.exit_code == 1 || outcome.exit_code == 2)
          << file.path() << ": " << outcome.exit_code;
      EXPECT_LT(outcome.seconds, 5.0);
      EXPECT_EQ(outcome.err.find(file.path().string() + ": error: "), 0u) << outcome.err;
      EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
    }
  }
  EXPECT_EQ(folder.file_count(), 0u);
}

}  // namespace
}  // namespace pileus
