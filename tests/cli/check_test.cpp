// The doctor: `pileus info --check`, and whether the commands that it prescribes help.
#include <cstdlib>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include "tests/cli/program.h"

namespace pileus {
namespace {

using Json = nlohmann::json;
using openvdb::Coord;

struct Check : testing::Test, ProgramTest {
  Check() { openvdb::initialize(); }

  /// A cube of density 1, 4 m wide.
  static openvdb::FloatGrid::Ptr cube(const std::string& name = "density") {
    auto grid = openvdb::FloatGrid::create();
    grid->setName(name);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    grid->fill(openvdb::CoordBBox(Coord(0), Coord(7)), 1.0f);
    return grid;
  }

  void write_vdb_file(const std::string& name, const openvdb::GridCPtrVec& grids) const {
    openvdb::io::File((folder / name).string()).write(grids);
  }

  Json check(const std::string& name, int exit_code, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{"info", name, "--check", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramOutcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.out << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return Json::parse(outcome.out);
  }

  /// Runs a command line of the program as a shell would.
  int run_in_shell(const std::string& command) const {
    EXPECT_EQ(command.rfind("pileus ", 0), 0u) << command;
    const bool is_render = command.rfind("pileus render", 0) == 0;
    const std::string line = "cd '" + folder.path().string() + "' && " + PILEUS_PROGRAM + command.substr(6) +
                             (is_render ? " -o fixed.png --size 16x9 --quiet" : " --quiet");
    return std::system(line.c_str());
  }

  /// Runs the fix of a finding; where it writes a file, that is free of the finding.
  void expect_fixed(const std::string& name, const Json& finding) const {
    const std::string fix = finding.at("fix");
    ASSERT_EQ(run_in_shell(fix), 0) << finding;
    if (fix.rfind("pileus convert", 0) != 0) return;
    const std::string fixed = std::filesystem::path(name).stem().string() + "_fixed.vdb";
    const ProgramOutcome again = run({"info", fixed, "--check", "--json"});
    const Json json = Json::parse(again.out);
    for (const Json& left : json.at("findings")) {
      EXPECT_NE(left.at("code"), finding.at("code")) << fix << " leaves " << left;
    }
  }
};

TEST_F(Check, a_healthy_file) {
  write_vdb_file("a.vdb", {cube()});
  const Json json = check("a.vdb", 0);
  EXPECT_EQ(json.at("healthy"), true);
  EXPECT_EQ(json.at("findings"), Json::array());
  EXPECT_EQ(json.at("grids").size(), 1u);
  const ProgramOutcome text = run({"info", "a.vdb", "--check"});
  EXPECT_EQ(text.exit_code, 0);
  for (const char* part :
       {"healthy: 0 errors, 0 warnings, 0 notes", "codec", "UniformScaleMap", "fog volume", "224"})
    EXPECT_NE(text.out.find(part), std::string::npos) << part << " in\n" << text.out;
}

TEST_F(Check, what_cannot_be_read_is_ill_and_still_gets_a_report) {
  write("cut.vdb", std::string(" BDV\0\0\0\0", 8));
  write("pointer.vdb", "version https://git-lfs.github.com/spec/v1\n");
  for (const char* name : {"cut.vdb", "pointer.vdb", "missing.vdb"}) {
    const Json json = check(name, 1);
    EXPECT_EQ(json.at("healthy"), false);
    EXPECT_EQ(json.at("findings").at(0).at("severity"), "error");
    EXPECT_EQ(check(name, 1, {"--trust"}), json);
  }
}

TEST_F(Check, every_fix_works) {
  auto bad = cube();
  bad->tree().setValueOn(Coord(1), std::numeric_limits<float>::quiet_NaN());
  write_vdb_file("bad values.vdb", {bad, cube("heat")});
  auto level_set = cube("surface");
  level_set->setGridClass(openvdb::GRID_LEVEL_SET);
  level_set->tree().root().setBackground(1.5f, true);
  level_set->fill(openvdb::CoordBBox(Coord(0), Coord(7)), -1.0f);
  write_vdb_file("surface.vdb", {level_set});
  write_vdb_file("surfaces.vdb", {level_set, level_set->deepCopy()});
  write_vdb_file("twins.vdb", {cube(), cube()});
  write_vdb_file("undecided.vdb", {cube("a'b"), cube("c")});
  auto large = cube();
  large->setTransform(openvdb::math::Transform::createLinearTransform(1e5));
  write_vdb_file("large.vdb", {large});
  auto dense = cube();
  dense->fill(openvdb::CoordBBox(Coord(0), Coord(7)), 900.0f);
  write_vdb_file("dense.vdb", {dense});
  auto unscaled = cube();
  unscaled->setTransform(openvdb::math::Transform::createLinearTransform(1.0));
  write_vdb_file("unscaled.vdb", {unscaled});

  auto filled = cube();
  filled->tree().root().setBackground(0.25f, true);
  write_vdb_file("filled.vdb", {filled});
  auto warm = cube("temperature"), still = cube("flame");
  still->clear();
  write_vdb_file("warm.vdb", {cube(), warm, still});
  auto bad_surface = level_set->deepCopy();
  bad_surface->setName("surface");
  bad_surface->tree().setValueOn(Coord(1), std::numeric_limits<float>::infinity());
  write_vdb_file("bad surface.vdb", {cube(), bad_surface});
  auto wind = openvdb::Vec3SGrid::create();
  wind->setName("vel");
  wind->setTransform(cube()->transformPtr());
  wind->tree().setValueOn(Coord(1), openvdb::Vec3s(0.25f, 0, 0));
  auto torn = wind->deepCopy();
  torn->setName("torn");
  torn->tree().setValueOn(Coord(2), openvdb::Vec3s(std::numeric_limits<float>::quiet_NaN(), 0, 0));
  write_vdb_file("wind.vdb", {cube(), wind, torn});

  for (const auto& [name, exit_code] : {std::pair{"bad values.vdb", 1},
                                        {"filled.vdb", 1},
                                        {"warm.vdb", 0},
                                        {"bad surface.vdb", 1},
                                        {"wind.vdb", 1},
                                        {"surface.vdb", 0},
                                        {"surfaces.vdb", 0},
                                        {"twins.vdb", 0},
                                        {"undecided.vdb", 0},
                                        {"large.vdb", 0},
                                        {"dense.vdb", 0},
                                        {"unscaled.vdb", 0}}) {
    int fixes = 0;
    const Json json = check(name, exit_code);
    for (const Json& finding : json.at("findings")) {
      if (!finding.contains("fix")) continue;
      ++fixes;
      expect_fixed(name, finding);
    }
    EXPECT_GT(fixes, 0) << name << json;
  }
}

TEST_F(Check, memory_beyond_the_budget_is_refused_before_it_is_taken) {
  auto wide = cube();
  for (int i = 0; i < 300; ++i) wide->tree().setValueOn(Coord(4096 * i, 0, 0), 1.0f);  // 85 MB of nodes
  write_vdb_file("wide.vdb", {wide});
  EXPECT_EQ(check("wide.vdb", 0).at("healthy"), true);
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"info", "wide.vdb", "--memory", "50M"},
        {"render", "wide.vdb", "-o", "a.png", "--memory", "50M"}}) {
    const ProgramOutcome refused = run(command);
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE((refused.out + refused.err).find("the budget is 50 MB; allow more with --memory"),
              std::string::npos)
        << refused.out << refused.err;
  }
  EXPECT_EQ(run({"info", "wide.vdb", "--memory", "lots"}).exit_code, 2);
}

}  // namespace
}  // namespace pileus
