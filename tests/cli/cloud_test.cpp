// pileus cloud: grids, limits, sequences.
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/program.h"

namespace pileus {
namespace {

/// A cloud of some thousand voxels that drifts.
constexpr const char* kCloud = R"(pileus = 1
[camera]
type = "perspective"
[volume.puff]
type = "cloud"
size = [3, 2, 3]
voxel_size = 0.1
noise = { offset = { times = [1, 3], values = [[0, 0, 0], [1, 0, 0]] } }
)";

struct CloudProgram : testing::Test, ProgramTest {
  std::string output(const std::vector<std::string>& arguments) const {
    const ProgramOutcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  }
};

TEST_F(CloudProgram, writes_a_file_for_each_frame_and_goes_on_where_it_stopped) {
  write("cloud.toml", kCloud);
  output({"cloud", "cloud.toml", "-o", "puff.%04d.vdb", "--frames", "1-3"});
  const std::string first = read_file(folder / "puff.0001.vdb"), second = read_file(folder / "puff.0002.vdb");
  EXPECT_NE(first, "");
  EXPECT_NE(first, second) << "the noise drifts";
  EXPECT_TRUE(std::filesystem::exists(folder / "puff.0003.vdb"));

  std::filesystem::remove(folder / "puff.0002.vdb");
  write("puff.0003.vdb", "left alone");
  output({"cloud", "cloud.toml", "-o", "puff.%04d.vdb", "--frames", "1-3", "--resume"});
  EXPECT_EQ(read_file(folder / "puff.0002.vdb"), second);
  EXPECT_EQ(read_file(folder / "puff.0003.vdb"), "left alone");

  output({"cloud", "cloud.toml", "-o", "one.vdb", "--frame", "2"});
  EXPECT_EQ(read_file(folder / "one.vdb"), second);
}

TEST_F(CloudProgram, writes_the_same_bytes_with_one_and_two_threads) {
  write("cloud.toml", kCloud);
  for (const std::string threads : {"1", "2"}) {
    output(
        {"cloud", "cloud.toml", "-o", threads + ".vdb", "--threads", threads, "--grids", "density,vel,Cd"});
  }
  EXPECT_NE(read_file(folder / "1.vdb"), "");
  EXPECT_EQ(read_file(folder / "1.vdb"), read_file(folder / "2.vdb"));
}

TEST_F(CloudProgram, writes_further_grids) {
  write("cloud.toml", kCloud);
  output({"cloud", "cloud.toml", "-o", "all.vdb", "--grids", "density,temperature,Cd,vel"});
  const auto json = nlohmann::json::parse(output({"info", "all.vdb", "--json"}));
  ASSERT_EQ(json.at("grids").size(), 4u);
  for (const auto& grid : json.at("grids"))
    EXPECT_EQ(grid.at("active_voxels"), json.at("grids")[0].at("active_voxels"));
  const ProgramOutcome unknown = run({"cloud", "cloud.toml", "-o", "a.vdb", "--grids", "densty"});
  EXPECT_EQ(unknown.exit_code, 2);
}

TEST_F(CloudProgram, keeps_to_limits) {
  write("cloud.toml", kCloud);
  EXPECT_NE(output({"cloud", "cloud.toml", "-o", "a.vdb", "--max-voxels", "100000"}).find("of 0.056 m"),
            std::string::npos);
  EXPECT_NE(output({"cloud", "cloud.toml", "-o", "b.vdb", "--max-bytes", "4MB"}), "");
}

TEST_F(CloudProgram, refuses_what_no_memory_holds_before_building_it) {
  write("cloud.toml", kCloud);
  const auto refusal = [&](const std::vector<std::string>& arguments) {
    const ProgramOutcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_LT(outcome.seconds, 20.0);
    EXPECT_EQ(folder.file_count(), 1u) << "something was written";
    return outcome.err;
  };
  const std::vector<std::vector<std::string>> too_much{
      {"cloud", "cloud.toml", "-o", "a.vdb", "--max-voxels", "1e12", "--memory", "1G"},
      {"cloud", "cloud.toml", "-o", "a.vdb", "--voxel-size", "0.01", "--memory", "10M"},
      {"render", "cloud.toml", "-o", "a.png", "--set", "volume.puff.voxel_size=0.01", "--memory", "10M"},
      {"render", "cloud.toml", "-o", "a.png", "--set", "volume.puff.voxel_size=0.0004", "--set",
       "volume.puff.max_voxels=1e12", "--memory", "1G"}};
  for (const auto& arguments : too_much) {
    const std::string told = refusal(arguments);
    for (const char* part :
         {"volume \"puff\": voxel_size = ", "makes a grid of", "that takes up to",
          "(the memory budget); nearest voxel_size that fits: ", "allow more with --memory"})
      EXPECT_NE(told.find(part), std::string::npos) << told;
  }
}

TEST_F(CloudProgram, tells_what_bounds_saved) {
  write("cloud.toml", kCloud);
  const std::string told = output({"cloud", "cloud.toml", "-o", "a.vdb"});
  EXPECT_NE(told.find("bounds found"), std::string::npos) << told;
  EXPECT_NE(told.find("% of the empty ones never were"), std::string::npos) << told;
  EXPECT_EQ(output({"cloud", "cloud.toml", "-o", "a.vdb", "--quiet"}), "");
}

TEST_F(CloudProgram, limits_may_be_written_in_many_ways_but_not_in_any) {
  write("cloud.toml", kCloud);
  for (const std::string bytes : {"4MB", "4e6", "4000000", "3.9 MiB", "4M"})
    output({"cloud", "cloud.toml", "-o", "a.vdb", "--max-bytes", bytes});
  for (const std::string bytes : {"", "0", "-4MB", "nan", "4XB", "99999999999999999999999", "four"}) {
    const ProgramOutcome outcome = run({"cloud", "cloud.toml", "-o", "b.vdb", "--max-bytes=" + bytes});
    EXPECT_EQ(outcome.exit_code, 2) << bytes << ": " << outcome.err;
  }
  EXPECT_EQ(run({"cloud", "cloud.toml", "-o", "b.vdb", "--frame", "nan"}).exit_code, 2);
  EXPECT_EQ(run({"cloud", "cloud.toml", "-o", "b.vdb", "--codec", "rar"}).exit_code, 2);
}

TEST_F(CloudProgram, says_which_cloud_is_wrong) {
  write("cloud.toml", kCloud);
  const ProgramOutcome fine = run({"cloud", "cloud.toml", "-o", "a.vdb", "--voxel-size", "1e-9"});
  EXPECT_NE(fine.err.find("error: volume \"puff\": voxel_size = 1e-09 m makes"), std::string::npos)
      << fine.err;
  const ProgramOutcome missing =
      run({"cloud", "cloud.toml", "-o", "a.vdb", "--set", "volume.puff.texture.file=\"no.png\""});
  EXPECT_NE(missing.err.find("no.png: error: volume \"puff\": does not exist"), std::string::npos)
      << missing.err;
}

TEST_F(CloudProgram, warns_of_clouds_without_a_voxel) {
  write("cloud.toml", kCloud);
  const ProgramOutcome outcome =
      run({"cloud", "cloud.toml", "-o", "a.vdb", "--set", "volume.puff.threshold=0.999"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.err.find("warning: a.vdb: density is empty"), std::string::npos) << outcome.err;
}

TEST_F(CloudProgram, refuses_sequences_that_make_no_sense) {
  write("cloud.toml", kCloud);
  EXPECT_EQ(run({"cloud", "cloud.toml", "-o", "a.%04d.vdb"}).exit_code, 2);
  EXPECT_EQ(run({"cloud", "cloud.toml", "-o", "a.vdb", "--frames", "1-3"}).exit_code, 2);
  EXPECT_EQ(run({"cloud", "cloud.toml", "-o", "a.vdb", "--resume"}).exit_code, 2);
  EXPECT_EQ(run({"cloud", "cloud.toml", "-o", "a.%04d.vdb", "--frames", "3-1"}).exit_code, 2);
  EXPECT_EQ(folder.file_count(), 1u) << "nothing but the recipe";
}

}  // namespace
}  // namespace pileus
