#include "vdb_io/diagnose.h"

#include <algorithm>
#include <limits>

#include "tests/fixtures/temp_folder.h"
#include "tests/vdb_io/vdb_test_files.h"

namespace pileus {
namespace {

using openvdb::Coord;

class Diagnose : public testing::Test {
 protected:
  /// A fog that nothing is wrong with: 8 m wide, densities from 0.5 to 1.
  static openvdb::FloatGrid::Ptr healthy_fog(const std::string& name = "density") {
    auto grid = make_grid(name);
    grid->tree().fill(openvdb::CoordBBox(Coord(0), Coord(15)), 1.0f, true);
    grid->tree().setValueOn(Coord(3), 0.5f);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    return grid;
  }

  VdbReport report_of(const openvdb::GridCPtrVec& grids) const {
    write_with_openvdb(path, grids);
    return inspect_vdb(path);
  }

  /// "error nan density, note no_class density", for the whole file.
  std::string codes_of(const openvdb::GridCPtrVec& grids) const {
    std::string text;
    for (const Finding& finding : report_of(grids).findings) {
      text += (text.empty() ? "" : ", ") + std::string(name_of(finding.severity)) + " " + finding.code +
              (finding.grid.empty() ? "" : " " + finding.grid);
    }
    return text;
  }

  /// The codes where one thing about the healthy fog is changed.
  template <class Change>
  std::string codes_after(const Change& change) const {
    auto grid = healthy_fog();
    change(*grid);
    return codes_of({grid});
  }

  TempFolder folder;
  std::filesystem::path path = folder / "a b.vdb";  // a name that a shell must have quoted
};

TEST_F(Diagnose, a_healthy_file_has_no_findings) {
  EXPECT_EQ(codes_of({healthy_fog()}), "");
  EXPECT_EQ(codes_of({healthy_fog(), healthy_fog("shadow")}), "");
}

TEST_F(Diagnose, values_no_density_may_have) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1.0f}) {
    EXPECT_EQ(codes_after([&](auto& grid) { grid.tree().setValueOn(Coord(1), bad); }), "error nan density")
        << bad;
  }
  auto other = healthy_fog("pressure");
  other->tree().setValueOn(Coord(1), -1.0f);
  EXPECT_EQ(codes_of({healthy_fog(), other}), "note negative pressure");
  EXPECT_EQ(codes_after([](auto& grid) { grid.tree().setValueOff(Coord(99), 1.0f); }),
            "warning inactive density");
  EXPECT_EQ(codes_after([](auto& grid) { grid.tree().root().setBackground(0.25f, true); }).substr(0, 24),
            "error background density");
  EXPECT_EQ(codes_after([](auto& grid) {
              grid.tree().clear();
              grid.tree().fill(openvdb::CoordBBox(Coord(0), Coord(15)), 0.0f, true);
            }),
            "warning all_zero density");
}

TEST_F(Diagnose, what_holds_nothing) {
  EXPECT_EQ(codes_of({}), "error no_grids");
  EXPECT_EQ(codes_after([](auto& grid) { grid.clear(); }), "error empty density");
  EXPECT_EQ(codes_of({healthy_fog(), make_grid("flame")}), "warning empty flame");
}

TEST_F(Diagnose, choices_and_repeated_names) {
  EXPECT_EQ(codes_of({healthy_fog("a"), healthy_fog("b")}), "warning undecided");
  const VdbReport report = report_of({healthy_fog(), healthy_fog()});
  ASSERT_EQ(report.findings.size(), 2u);
  EXPECT_EQ(report.findings[1].code, "duplicate");
  expect_mentions(report.findings[1].fix, "--rename 'density[0]=density' --rename 'density[1]=density_2'");
}

TEST_F(Diagnose, level_sets_given_as_densities) {
  auto distances = make_grid("surface", openvdb::GRID_LEVEL_SET);
  distances->tree().root().setBackground(0.3f, true);
  distances->tree().setValueOn(Coord(0), -0.2f);
  distances->tree().setValueOn(Coord(9), 0.25f);
  distances->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  EXPECT_EQ(codes_of({distances}), "note level_set surface");
  distances->setName("density");
  EXPECT_EQ(codes_of({distances}), "error level_set_as_density density");
  distances->setGridClass(openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(codes_of({distances}), "error level_set_as_density density");
}

TEST_F(Diagnose, units_that_are_probably_not_meant) {
  EXPECT_EQ(codes_after([](auto& grid) { grid.tree().setValueOn(Coord(1), 300.0f); }),
            "warning dense density");
  EXPECT_EQ(codes_after(
                [](auto& grid) { grid.setTransform(openvdb::math::Transform::createLinearTransform(1e-3)); }),
            "warning thin density");
  EXPECT_EQ(codes_after(
                [](auto& grid) { grid.setTransform(openvdb::math::Transform::createLinearTransform(1.0)); }),
            "warning voxel_size_1 density");
  EXPECT_EQ(codes_after(
                [](auto& grid) { grid.setTransform(openvdb::math::Transform::createLinearTransform(1e5)); }),
            "warning size density");
  EXPECT_EQ(codes_after([](auto& grid) { grid.clearGridClass(); }), "note no_class density");
}

TEST_F(Diagnose, statistics_that_are_not_those_of_the_tree) {
  auto grid = healthy_fog();
  grid->insertMeta("file_voxel_count", openvdb::Int64Metadata(7));
  EXPECT_EQ(codes_of({grid}), "");  // OpenVDB writes the true number over it
  openvdb::io::File file(path.string());
  file.setGridStatsMetadataEnabled(false);
  file.write({grid});
  const VdbReport report = inspect_vdb(path);
  ASSERT_EQ(report.findings.size(), 1u);
  EXPECT_EQ(report.findings[0].code, "statistics");
}

TEST_F(Diagnose, heat_and_velocity) {
  const auto with_heat = [&](float value) {
    auto heat = healthy_fog("temperature");
    heat->tree().setValueOn(Coord(1), value);
    return codes_of({healthy_fog(), heat});
  };
  EXPECT_EQ(with_heat(2.0f), "note heat_relative temperature");
  EXPECT_EQ(with_heat(90.0f), "warning heat_unit temperature");
  EXPECT_EQ(with_heat(1200.0f), "note heat_kelvin temperature");

  const auto with_speed = [&](float metres) {
    auto velocity = make_grid<openvdb::Vec3SGrid>("vel", openvdb::GRID_STAGGERED);
    velocity->tree().setValueOn(Coord(1), openvdb::Vec3f(0, metres, 0));
    velocity->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
    return codes_of({healthy_fog(), velocity});
  };
  EXPECT_EQ(with_speed(0.3f), "note not_scalar vel, note velocity_per_frame vel");
  EXPECT_EQ(with_speed(12.0f), "note not_scalar vel");
  EXPECT_EQ(with_speed(std::numeric_limits<float>::quiet_NaN()), "note not_scalar vel, error nan vel");
}

TEST_F(Diagnose, fixes_name_the_file_as_a_shell_reads_it) {
  auto grid = healthy_fog();
  grid->tree().setValueOn(Coord(1), -1.0f);
  const VdbReport report = report_of({grid, healthy_fog("shadow")});
  ASSERT_EQ(report.findings.size(), 1u);
  EXPECT_EQ(report.findings[0].fix, "pileus convert '" + path.string() + "' '" +
                                        (folder / "a b_fixed.vdb").string() + "' --min density=0");
  EXPECT_EQ(report.findings[0].scene, "nan = \"zero\"");
}

TEST_F(Diagnose, real_files) {
  for (const char* name : {"dragon", "smoke1", "houdini_sphere_density", "wdas_cloud_sixteenth",
                           "sphere_levelset", "blender_gas_0010"}) {
    PILEUS_REAL_FILE(file, fmt::format("vdb/{}.vdb", name));
    for (const Finding& finding : inspect_vdb(file).findings) {
      EXPECT_NE(finding.severity, Severity::error) << name << ": " << finding.grid << " " << finding.message;
    }
  }
}

}  // namespace
}  // namespace pileus
