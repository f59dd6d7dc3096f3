// `pileus convert` as a person meets it.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "tests/cli/program.h"

namespace pileus {
namespace {

void expect_mentions(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "in: " << text << "\nexpected: " << part;
}

class Convert : public ProgramTest, public testing::Test {
 protected:
  Convert() {
    write("a.raw", std::string("\0\1\2\3\4\5\6\7", 8));
    write("a.raw.json", R"({"pileus_volume": 1, "type": "uint8", "size": [2, 2, 2], "grid": "Smoke",
                            "world_from_index": [[0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 0.5, 0]]})");
  }

  std::string refusal(std::vector<std::string> arguments, int exit_code) {
    arguments.insert(arguments.begin(), "convert");
    const ProgramOutcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    return outcome.err;
  }
};

TEST_F(Convert, says_what_it_wrote) {
  const ProgramOutcome outcome =
      run({"convert", "a.raw", "a.vdb", "--grid", "density", "--rename", "Smoke=density"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "a.vdb: density <- Smoke (float, fog volume), 7 active voxels of 0.5 m\n");
  EXPECT_EQ(outcome.err, "pileus: note: a.raw: grid Smoke (float, fog volume) taken for \"density\"\n");
}

TEST_F(Convert, goes_round_all_formats) {
  std::string from = "a.raw";
  for (const char* to : {"b.vdb", "b.nvdb", "b.npy", "c.vdb", "b.df3", "d.vdb", "b.raw"}) {
    const ProgramOutcome outcome = run({"convert", from, to, "--quiet"});
    EXPECT_EQ(outcome.exit_code, 0) << from << " to " << to << ": " << outcome.err;
    EXPECT_EQ(outcome.out + outcome.err, "");
    const ProgramOutcome info = run({"info", to});
    expect_mentions(info.out, "active voxels  7\n");
    expect_mentions(info.out, " to 7, background 0\n");
    from = to;
  }
  const ProgramOutcome render = run({"render", "b.npy", "-o", "a.png", "--size", "16x16"});
  EXPECT_EQ(render.exit_code, 0) << render.err;
}

TEST_F(Convert, edits_on_the_way) {
  EXPECT_EQ(
      run({"convert", "a.raw", "a.vdb", "--resample", "2x", "--crop=-0.1,-0.1,-0.1,0.6,0.1,0.6"}).exit_code,
      0);
  expect_mentions(run({"info", "a.vdb"}).out, "1 x 1 x 1 m");
  EXPECT_EQ(run({"convert", "a.raw", "b.vdb", "--half", "--codec", "none"}).exit_code, 0);
  expect_mentions(run({"info", "b.vdb"}).out, "float (saved as half)");
}

TEST_F(Convert, changes_values_and_scale) {
  const ProgramOutcome outcome =
      run({"convert", "a.raw", "a.vdb", "--min", "Smoke=2", "--multiply", "Smoke=10", "--background",
           "Smoke=0", "--nan", "Smoke=0", "--scale", "0.1", "--rename", "Smoke=density"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string info = run({"info", "a.vdb"}).out;
  expect_mentions(info, "range          20 to 70");
  expect_mentions(info, "0.05 x 0.05 x 0.05 m");
}

TEST_F(Convert, a_lowest_value_makes_no_density_of_empty_space) {
  const ProgramOutcome outcome = run({"convert", "a.raw", "a.vdb", "--min", "Smoke=3"});
  EXPECT_EQ(outcome.err, "pileus: note: a.raw: grid \"Smoke\": 2 voxels raised by --min 3\n");
  const std::string info = run({"info", "a.vdb"}).out;
  expect_mentions(info, "range          3 to 7, background 0\n");
  expect_mentions(info, "active voxels  7\n");
}

TEST_F(Convert, scales_only_to_what_can_be_read_again) {
  for (const char* output : {"b.vdb", "b.nvdb", "b.df3", "b.npy", "b.raw"}) {
    for (const char* factor : {"1e300", "1e32", "1e-6", "1e-300"}) {
      expect_mentions(refusal({"a.raw", output, "--scale", factor}, 1),
                      "a.raw: error: grid \"Smoke\" would get voxels of ");
      EXPECT_FALSE(std::filesystem::exists(folder / output));
    }
    for (const char* factor : {"1e29", "1e-3"}) {
      EXPECT_EQ(run({"convert", "a.raw", output, "--scale", factor}).exit_code, 0);
      EXPECT_EQ(run({"info", output}).exit_code, 0) << output << " scaled by " << factor;
      std::filesystem::remove(folder / output);
    }
  }
}

TEST_F(Convert, merges_and_refuses_two_of_one_name) {
  run({"convert", "a.raw", "a.vdb"});
  run({"convert", "a.raw", "b.vdb", "--rename", "Smoke=heat"});
  const ProgramOutcome outcome = run({"convert", "a.vdb", "both.vdb", "--merge", "b.vdb"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  expect_mentions(outcome.out, "both.vdb: Smoke (float");
  expect_mentions(outcome.out, "both.vdb: heat (float");
  expect_mentions(refusal({"a.vdb", "c.vdb", "--merge", "a.vdb"}, 2), "two grids are called \"Smoke\"");
  EXPECT_FALSE(std::filesystem::exists(folder / "c.vdb"));
}

TEST_F(Convert, takes_sequences) {
  for (const char* frame : {"0009", "0010", "0012"}) {
    std::filesystem::copy_file(folder / "a.raw", folder / (std::string("s.") + frame + ".raw"));
    std::filesystem::copy_file(folder / "a.raw.json", folder / (std::string("s.") + frame + ".raw.json"));
  }
  EXPECT_EQ(run({"convert", "s.%04d.raw", "s.%d.vdb", "--frames", "9-10"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "s.9.vdb"));
  EXPECT_TRUE(std::filesystem::exists(folder / "s.10.vdb"));
  EXPECT_EQ(run({"convert", "s.%04d.raw", "t.%04d.vdb", "--frames", "10-12x2"}).exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(folder / "t.0011.vdb"));
  expect_mentions(refusal({"s.%04d.raw", "t.%04d.vdb", "--frames", "10-12"}, 1),
                  "s.0011.raw: error: no such file");
  expect_mentions(refusal({"s.%04d.raw", "t.%04d.vdb"}, 2), "expected --frames FIRST-LAST");
  expect_mentions(refusal({"s.%04d.raw", "t.vdb", "--frames", "9-10"}, 2), "written to the same file");
  expect_mentions(refusal({"a.raw", "t.vdb", "--frames", "9-10"}, 2), "a place for the number in both names");
  expect_mentions(refusal({"s.%s.raw", "t.%04d.vdb", "--frames", "9"}, 2),
                  "expected one place for the frame's number");
  for (const char* frames : {"10-9", "a", "1-", "-3", "1-5x0", "1-99999999999"}) {
    expect_mentions(refusal({"s.%04d.raw", "t.%04d.vdb", "--frames", frames}, 2), "--frames");
  }
}

TEST_F(Convert, refuses_what_it_cannot_do) {
  expect_mentions(refusal({"a.raw", "a.raw"}, 2), "is an input; expected another name");
  expect_mentions(refusal({"a.raw", "a.obj"}, 2),
                  "expected one that ends in .vdb, .nvdb, .df3, .npy or .raw");
  expect_mentions(refusal({"missing.vdb", "b.vdb"}, 1), "missing.vdb: error: no such file");
  expect_mentions(refusal({"a.raw", "b.vdb", "--grid", "vel"}, 1),
                  "no grid \"vel\"; found Smoke (float, fog volume)");
  expect_mentions(refusal({"a.raw", "b.vdb", "--rename", "Smok=x"}, 2), "nearest: Smoke");
  expect_mentions(refusal({"a.raw", "b.vdb", "--rename", "x"}, 2), "expected OLD=NEW");
  expect_mentions(refusal({"a.raw", "b.vdb", "--resample", "0"}, 2),
                  "expected the edge of a voxel in metres");
  expect_mentions(refusal({"a.raw", "b.vdb", "--resample", "nanx"}, 2), "expected the edge");
  expect_mentions(refusal({"a.raw", "b.vdb", "--crop=0,0,0,1,1"}, 2), "expected X0,Y0,Z0,X1,Y1,Z1");
  expect_mentions(refusal({"a.raw", "b.vdb", "--crop=0,0,0,-1,1,1"}, 2), "each lower end first");
  expect_mentions(refusal({"a.raw", "b.vdb", "--codec", "lz4"}, 2), "expected none, zip or blosc");
  expect_mentions(refusal({"a.raw", "b.df3", "--bits", "12"}, 2), "--bits");
  expect_mentions(refusal({"a.raw", "b.vdb", "--bits", "8"}, 2), "--bits is for .df3 files");
  expect_mentions(refusal({"a.raw", "b.nvdb", "--half"}, 2), "NanoVDB has no half floats");
  expect_mentions(refusal({"a.raw", "b.vdb", "--nan", "density=0"}, 2), "no grid \"density\" is taken over");
  for (const char* text : {"Smoke", "=0", "Smoke=", "Smoke=x", "Smoke=nan"}) {
    expect_mentions(refusal({"a.raw", "b.vdb", "--multiply", text}, 2), "expected GRID=NUMBER");
  }
  EXPECT_EQ(refusal({"a.raw", "b.vdb", "--multiply", "Smoke=1e39"}, 2),
            "pileus: error: --multiply Smoke=1e39; expected a number up to 3.40282e+38\n");
  expect_mentions(refusal({"a.raw", "b.vdb", "--levelset-to-fog"}, 2),
                  "none of the grids taken over is a level set");
  expect_mentions(refusal({"a.raw", "b.vdb", "--crop=5,5,5,6,6,6"}, 2), "--crop leaves no voxel of any grid");
  for (const char* text : {"0", "-1", "nan", "inf", "x"}) {
    expect_mentions(refusal({"a.raw", "b.vdb", "--scale", text}, 2), "--scale");
  }
  std::filesystem::create_directory(folder / "folder.vdb");
  expect_mentions(refusal({"a.raw", "folder.vdb"}, 1), "is a folder; expected the name of a file");
  expect_mentions(refusal({"folder.vdb", "b.vdb"}, 1), "is not a regular file");
  expect_mentions(refusal({"a.raw", "missing/b.vdb"}, 1), "no file can be created in");
  expect_mentions(refusal({"a.raw", "b.vdb", "--resample", "0.0001x"}, 1), "expected 0.001 to 1000");
  expect_mentions(refusal({"a.raw", "b.vdb", "--resample", "0.001x", "--memory", "100M"}, 1),
                  "the budget is 100 MB");
  expect_mentions(refusal({"a.raw", "b.vdb", "--crop=nan,0,0,1,1,1"}, 2), "expected X0,Y0,Z0,X1,Y1,Z1");
  for (const auto& file : std::filesystem::directory_iterator(folder.path())) {
    const std::string name = file.path().filename();
    EXPECT_TRUE(name == "a.raw" || name == "a.raw.json" || name == "folder.vdb") << name << " is left over";
  }
}

TEST_F(Convert, leaves_nothing_when_interrupted) {
  write("big.raw", std::string(100 * 100 * 100, '\1'));
  write("big.raw.json", R"({"pileus_volume": 1, "type": "uint8", "size": [100, 100, 100]})");
  for (const double seconds : {0.05, 0.3, 1.0}) {
    Program program(
        {"convert", (folder / "big.raw").string(), (folder / "big.vdb").string(), "--resample", "0.4x"});
    program.wait_until_it_handles(SIGINT);
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    program.send(SIGINT);
    const ProgramOutcome outcome = program.wait();
    EXPECT_TRUE(outcome.exit_code == 130 || outcome.exit_code == 0) << outcome.err;
    for (const auto& file : std::filesystem::directory_iterator(folder.path())) {
      EXPECT_EQ(file.path().filename().string().find("partial"), std::string::npos) << file.path();
    }
    if (std::filesystem::exists(folder / "big.vdb")) {
      EXPECT_EQ(run({"info", "big.vdb", "--trust"}).exit_code, 0) << "what is there is whole";
    }
  }
}

}  // namespace
}  // namespace pileus
