#include "vdb_io/openvdb/volume_file.h"

#include <cmath>
#include <random>

#include "tests/fixtures/temp_folder.h"
#include "tests/vdb_io/vdb_test_files.h"
#include "vdb_io/grid_aliases.h"
#include "vdb_io/inspect.h"
#include "vdb_io/openvdb/vdb_reader.h"
#include "vdb_io/openvdb/volume_writer.h"
#include "vdb_io/vdb_summary.h"

namespace pileus {
namespace {

using openvdb::Coord;
using Grids = std::vector<openvdb::GridBase::Ptr>;

class VolumeFile : public testing::Test {
 protected:
  TempFolder folder;

  openvdb::GridBase::Ptr read(const std::string& name, const std::string& grid = "") {
    const VdbDirectory directory = read_volume_directory(folder / name);
    return read_volume_grid(folder / name, directory, choose_grid(folder / name, directory, grid));
  }

  std::vector<std::string> write(const std::string& name, const Grids& grids,
                                 const VolumeWriteOptions& options = {}) {
    return write_volume(folder / name, grids, {}, options);
  }
};

openvdb::FloatGrid::Ptr blob(const std::string& name = "density") {
  auto grid = make_grid(name);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> value(0.0f, 2.0f);
  for (int x = -5; x <= 6; ++x) {
    for (int y = 0; y <= 9; ++y) {
      for (int z = 20; z <= 27; ++z) {
        if (random() % 4 != 0) grid->tree().setValueOn(Coord(x, y, z), value(random) + 1e-6f);
      }
    }
  }
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  grid->transform().postTranslate(openvdb::Vec3d(1, -2, 0.5));
  return grid;
}

void expect_same_active_voxels(const openvdb::FloatGrid& a, const openvdb::FloatGrid& b, double error) {
  EXPECT_EQ(a.activeVoxelCount(), b.activeVoxelCount());
  for (auto value = a.cbeginValueOn(); value; ++value) {
    ASSERT_NEAR(b.tree().getValue(value.getCoord()), *value, error) << value.getCoord();
  }
}

TEST_F(VolumeFile, every_format_brings_a_density_back_to_its_place) {
  const auto grid = blob();
  const std::pair<const char*, double> formats[] = {
      {"a.vdb", 0.0}, {"a.nvdb", 0.0}, {"a.npy", 0.0}, {"a.raw", 0.0}, {"a.df3", 0.51 * 2.001 / 65535}};
  for (const auto& [name, error] : formats) {
    write(name, {grid});
    const auto back = openvdb::gridPtrCast<openvdb::FloatGrid>(read(name));
    ASSERT_TRUE(back) << name;
    expect_same_active_voxels(*grid, *back, error);
    EXPECT_EQ(back->getName(), "density") << name;
    EXPECT_EQ(back->getGridClass(), openvdb::GRID_FOG_VOLUME) << name;
    EXPECT_EQ(back->transform(), grid->transform()) << name;
    EXPECT_EQ(back->background(), 0.0f) << name;
  }
}

TEST_F(VolumeFile, every_format_is_read_as_a_density_framed_and_inspected) {
  const auto grid = blob();
  for (const char* name : {"a.vdb", "a.nvdb", "a.npy", "a.raw", "a.df3"}) {
    write(name, {grid});
    EXPECT_EQ(read_density_grid(folder / name).grid->activeVoxelCount(), grid->activeVoxelCount()) << name;
    const GridSummary summary = summarize_density(folder / name, "");
    EXPECT_NEAR(summary.bounds.min.x, 1 + 0.25 * -5.5, 1e-9) << name;
    EXPECT_NEAR(summary.bounds.max.z, 0.5 + 0.25 * 27.5, 1e-9) << name;
    const VdbReport report = inspect_vdb(folder / name);
    ASSERT_EQ(report.grids.size(), 1u) << name;
    EXPECT_EQ(report.grids[0].problem, "") << name;
    EXPECT_EQ(report.default_grid, "density") << name;
    ASSERT_TRUE(report.grids[0].structure && report.grids[0].values) << name;
    EXPECT_EQ(report.grids[0].structure->active_voxels, grid->activeVoxelCount()) << name;
    EXPECT_EQ(report.grids[0].structure->active_bounds.min, Vec3i(-5, 0, 20)) << name;
  }
}

TEST_F(VolumeFile, vectors_and_other_types_are_carried) {
  auto vel = make_grid<openvdb::Vec3SGrid>("vel", openvdb::GRID_STAGGERED);
  vel->tree().setValueOn(Coord(1, 2, 3), openvdb::Vec3s(1, -2, 0.5f));
  auto flags = make_grid<openvdb::Int32Grid>("flags", openvdb::GRID_UNKNOWN);
  flags->tree().setValueOn(Coord(4), 7);
  for (const char* name : {"a.vdb", "a.nvdb"}) {
    write(name, {blob(), vel, flags});
    const auto back = openvdb::gridPtrCast<openvdb::Vec3SGrid>(read(name, "vel"));
    ASSERT_TRUE(back) << name;
    EXPECT_EQ(back->tree().getValue(Coord(1, 2, 3)), openvdb::Vec3s(1, -2, 0.5f)) << name;
    EXPECT_EQ(back->getGridClass(), openvdb::GRID_STAGGERED) << name;
    ASSERT_TRUE(openvdb::gridPtrCast<openvdb::Int32Grid>(read(name, "flags"))) << name;
  }
  for (const char* name : {"a.npy", "a.raw"}) {
    write(name, {vel});
    const auto back = openvdb::gridPtrCast<openvdb::Vec3SGrid>(read(name));
    ASSERT_TRUE(back) << name;
    EXPECT_EQ(back->tree().getValue(Coord(1, 2, 3)), openvdb::Vec3s(1, -2, 0.5f)) << name;
    EXPECT_EQ(back->getName(), "vel") << name;
  }
}

TEST_F(VolumeFile, vdb_keeps_metadata_and_half_of_the_source) {
  auto grid = blob();
  grid->insertMeta("houdini_note", openvdb::StringMetadata("hello"));
  grid->setSaveFloatAsHalf(true);
  openvdb::MetaMap metadata;
  metadata.insertMeta("creator", openvdb::StringMetadata("Houdini"));
  metadata.insertMeta("frame", openvdb::Int32Metadata(12));
  write_volume(folder / "a.vdb", {grid}, metadata, {});
  const auto back = read("a.vdb");
  EXPECT_EQ(back->metaValue<std::string>("houdini_note"), "hello");
  EXPECT_TRUE(back->saveFloatAsHalf());
  const openvdb::MetaMap file = read_volume_metadata(folder / "a.vdb");
  EXPECT_EQ(file.metaValue<std::string>("creator"), "Houdini");
  EXPECT_EQ(file.metaValue<int32_t>("frame"), 12);
  EXPECT_NE(write_volume(folder / "a.nvdb", {read("a.vdb")}, metadata, {}).at(0).find("metadata entries"),
            std::string::npos)
      << "what is lost is said";
}

TEST_F(VolumeFile, half_loses_at_most_half_an_ulp_of_half) {
  const auto grid = blob();
  VolumeWriteOptions half;
  half.half = true;
  for (const char* name : {"a.vdb", "a.npy", "a.raw"}) {
    write(name, {grid}, half);
    const auto back = openvdb::gridPtrCast<openvdb::FloatGrid>(read(name));
    for (auto value = grid->cbeginValueOn(); value; ++value) {
      const float ulp = std::ldexp(1.0f, std::max(std::ilogb(*value), -14) - 10);
      ASSERT_NEAR(back->tree().getValue(value.getCoord()), *value, 0.5f * ulp) << name;
    }
  }
  expect_mentions(error_of([&] { write("a.nvdb", {grid}, half); }), "NanoVDB has no half floats");
  expect_mentions(error_of([&] { write("a.df3", {grid}, half); }), "--bits 8, 16 or 32");
  grid->tree().setValueOn(Coord(0), 70000.0f);
  for (const char* name : {"b.vdb", "b.npy"}) {
    expect_mentions(error_of([&] { write(name, {grid}, half); }), "which half floats cannot");
  }
}

TEST_F(VolumeFile, codecs_are_those_of_the_format) {
  auto vel = make_grid<openvdb::Vec3SGrid>("vel", openvdb::GRID_UNKNOWN);
  for (int i = 0; i < 500; ++i) vel->tree().setValueOn(Coord(i, 0, 0), openvdb::Vec3s(1));
  const auto compression = [&](const std::string& codec) {
    VolumeWriteOptions options;
    options.codec = codec;
    write("a.vdb", {vel}, options);
    return compression_text(read_vdb_directory(folder / "a.vdb").grids.front().compression);
  };
  EXPECT_EQ(compression("zip"), "zip + active mask");
  EXPECT_EQ(compression("none"), "active mask");
  EXPECT_EQ(compression(""), "blosc + active mask");
  VolumeWriteOptions options;
  options.codec = "zip";
  expect_mentions(write("a.vdb", {blob()}, options).at(0), "OpenVDB zips neither fog volumes nor level sets");
  expect_mentions(error_of([&] { write("a.npy", {blob()}, options); }), "codec \"zip\"; expected none");
  options.codec = "lzma";
  expect_mentions(error_of([&] { write("a.vdb", {blob()}, options); }), "expected none, zip or blosc");
}

TEST_F(VolumeFile, refuses_unknown_extensions_and_several_grids_in_dense_files) {
  expect_mentions(error_of([&] { write("a.obj", {blob()}); }), "expected .vdb, .nvdb, .df3, .npy or .raw");
  write_bytes(folder / "a.obj", "v 0 0 0");
  expect_mentions(error_of([&] { read_volume_directory(folder / "a.obj"); }), "extension \".obj\"");
  expect_mentions(error_of([&] { write("a.npy", {blob(), blob("b")}); }), "choose one with --grid");
  expect_mentions(error_of([&] { write("a.npy", {make_grid()}); }), "is empty (0 active voxels)");
}

TEST_F(VolumeFile, real_caches_go_to_nvdb_and_back_without_loss) {
  PILEUS_REAL_FILE(cache, "vdb/blender_gas_0010.vdb");
  const VdbDirectory directory = read_volume_directory(cache);
  Grids grids;
  for (const VdbGridEntry& entry : directory.grids)
    grids.push_back(read_volume_grid(cache, directory, entry));
  write("a.nvdb", grids);
  const VdbDirectory back_directory = read_volume_directory(folder / "a.nvdb");
  ASSERT_EQ(back_directory.grids.size(), directory.grids.size());
  for (size_t i = 0; i < grids.size(); ++i) {
    const auto back = read_volume_grid(folder / "a.nvdb", back_directory, back_directory.grids[i]);
    EXPECT_EQ(back->getName(), grids[i]->getName());
    EXPECT_EQ(back->valueType(), grids[i]->valueType());
    EXPECT_EQ(back->getGridClass(), grids[i]->getGridClass());
    EXPECT_EQ(back->transform(), grids[i]->transform());
    EXPECT_EQ(back->activeVoxelCount(), grids[i]->activeVoxelCount());
    const auto density = openvdb::gridPtrCast<openvdb::FloatGrid>(grids[i]);
    if (!density) continue;
    const auto density_back = openvdb::gridPtrCast<openvdb::FloatGrid>(back);
    ASSERT_TRUE(density_back->tree().hasSameTopology(density->tree()));
    auto b = density_back->cbeginValueAll();
    for (auto a = density->cbeginValueAll(); a; ++a, ++b) ASSERT_EQ(*a, *b);
  }
}

TEST(GridAliases, know_the_big_programs) {
  for (const char* name : {"density", "Density", "d", "smoke", "Smoke", "fog", "voxel_fog_density"}) {
    EXPECT_TRUE(means_the_same(name, "density")) << name;
  }
  EXPECT_TRUE(means_the_same("velocity", "vel"));
  EXPECT_TRUE(means_the_same("Cd", "color"));
  EXPECT_TRUE(means_the_same("heat", "temperature"));
  EXPECT_FALSE(means_the_same("density", "temperature"));
  EXPECT_FALSE(means_the_same("shadow", "density"));
  EXPECT_TRUE(means_the_same("Shadow", "shadow"));
}

TEST_F(VolumeFile, an_alias_is_taken_and_told) {
  auto heat = make_grid("heat");
  heat->tree().setValueOn(Coord(0), 1.0f);
  write("a.vdb", {blob("Smoke"), heat});
  const DensityGrid chosen = read_density_grid(folder / "a.vdb");
  EXPECT_EQ(chosen.source.name, "Smoke");
  ASSERT_FALSE(chosen.notes.empty());
  EXPECT_EQ(chosen.notes[0], "grid Smoke (float, fog volume) chosen among 2");
  const DensityGrid asked = read_density_grid(folder / "a.vdb", {"density"});
  EXPECT_EQ(asked.source.name, "Smoke");
  EXPECT_EQ(asked.notes.at(0), "grid Smoke (float, fog volume) taken for \"density\"");
  expect_mentions(error_of([&] { read_density_grid(folder / "a.vdb", {"velocity"}); }),
                  "no grid \"velocity\"");
}

}  // namespace
}  // namespace pileus
