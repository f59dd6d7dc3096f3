// The march with grids at coarser levels, against the exact integrator and against itself without them.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "tests/fixtures/march_scenes.h"
#include "tests/fixtures/picture_scene.h"

namespace pileus {
namespace {

const std::string kOn = "{ type = \"march\", level_of_detail = true }", kOff = "\"march\"",
                  kExact = "\"exact\"";

double difference(const Rgb& a, const Rgb& b) {
  const Rgb d = a - b;
  return std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
}

/// A blob of many small voxels.
class LevelOfDetail : public testing::Test {
 protected:
  LevelOfDetail() {
    initialize_openvdb();
    auto grid = openvdb::FloatGrid::create(0.0f);
    auto accessor = grid->getAccessor();
    for_each_voxel_of_blob({0, 0, 0}, {70, 60, 50}, [&](const Vec3i& p, float rho) {
      accessor.setValue({p.x, p.y, p.z}, rho);
    });
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    grid->setName("density");
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.03));
    write_grid(m_folder / "fine.vdb", grid);
    write_grid(m_folder / "rough.vdb", random_grid(64, 7));
  }

  std::string volume(const std::string& file, const std::string& more, const std::string& name) const {
    return fmt::format("[volume.{}]\ntype = \"vdb\"\nfile = \"{}\"\n{}\n", name,
                       (m_folder / (file + ".vdb")).string(), more);
  }

  /// 64^3 random voxels.
  std::string rough(const std::string& more) const {
    return volume("rough", "scale = [0.03, 0.03, 0.03]\ntranslate = [-1, -1, -1]\n" + more, "rough");
  }

  std::string blob_from(double distance, const std::string& more = "extinction = 3") const {
    return MarchScenes::camera(fmt::format("[0, 1, {}]", distance)) + volume("fine", more, "blob") +
           MarchScenes::sun() + "[background]\ntype = \"constant\"\nradiance = [0.3, 0.5, 0.9]\n";
  }

  static std::string choice(const PictureScene& scene, const std::string& volume = "blob") {
    for (const std::string& sentence : scene.tracer().choices()) {
      if (sentence.find("density of " + volume + " ") != std::string::npos) return sentence;
    }
    return "";
  }

  TempFolder m_folder;
};

TEST_F(LevelOfDetail, from_afar_is_within_the_tolerance_and_knows_its_error) {
  const Vec2i size(60, 40);
  for (const double tolerance : {0.03, 0.01, 0.003}) {
    const std::string text = blob_from(14.0);
    const PictureScene on(kOn, text, tolerance, size), off(kOff, text, tolerance, size);
    EXPECT_EQ(choice(off), "");
    EXPECT_NE(choice(on).find(" at level "), std::string::npos);
    if (tolerance >= 0.02) {
      EXPECT_EQ(choice(on).find(" at level 0 "), std::string::npos) << choice(on);
    }
    const std::vector<RayResult> with = on.picture(64), without = off.picture(64),
                                 expected = PictureScene(kExact, text, 1e-5, size).picture(64);
    size_t honest = 0, known = 0;
    for (size_t i = 0; i < with.size(); ++i) {
      const double error = difference(with[i].radiance, expected[i].radiance);
      ASSERT_LE(error, tolerance) << choice(on) << ", ray " << i;
      ASSERT_LE(difference(with[i].radiance, without[i].radiance), tolerance) << choice(on) << ", ray " << i;
      ASSERT_NEAR(with[i].transmittance, expected[i].transmittance, 3.0 * tolerance) << i;
      if (expected[i].transmittance == 1.0 && with[i].transmittance == 1.0) {
        ASSERT_EQ(with[i].error, 0.0) << i;
        continue;
      }
      ++known;
      honest += with[i].error + 1e-5 >= error;
    }
    EXPECT_GE(double(honest), 0.9 * double(known)) << choice(on);
  }
}

TEST_F(LevelOfDetail, what_is_too_thin_to_show_its_voxels_has_levels) {
  const std::string text =
      MarchScenes::camera("[0, 1, 14]") + rough("extinction = 0.01") + MarchScenes::sun();
  const double tolerance = 0.01;
  const Vec2i size(60, 40);
  const PictureScene on(kOn, text, tolerance, size), off(kOff, text, tolerance, size);
  EXPECT_EQ(choice(on, "rough").find(" at level 0 "), std::string::npos) << choice(on, "rough");
  const std::vector<RayResult> with = on.picture(64), without = off.picture(64),
                               expected = PictureScene(kExact, text, 1e-5, size).picture(64);
  for (size_t i = 0; i < with.size(); ++i) {
    ASSERT_LE(difference(with[i].radiance, expected[i].radiance), tolerance) << i;
    ASSERT_LE(difference(with[i].radiance, without[i].radiance), tolerance) << i;
  }
}

TEST_F(LevelOfDetail, coarser_levels_touch_fewer_bytes) {
  const PictureScene on(kOn, blob_from(14.0), 0.03, {60, 40});
  double now = 0.0, before = 0.0;
  const std::string sentence = choice(on);
  ASSERT_EQ(
      std::sscanf(sentence.c_str(), "density of blob at level %*d of %*d, %lf MB of %lf MB", &now, &before),
      2)
      << sentence;
  EXPECT_LT(now, 0.25 * before);
}

TEST_F(LevelOfDetail, from_near_there_is_none) {
  const PictureScene on(kOn, blob_from(2.6), 0.03, {640, 360});
  EXPECT_EQ(choice(on), "");
  const PictureScene inside(kOn, blob_from(0.1), 0.03, {16, 9});
  EXPECT_EQ(choice(inside), "");
}

TEST_F(LevelOfDetail, what_would_show_is_not_taken) {
  const std::string text = MarchScenes::camera("[0, 1, 8]") + rough("extinction = 20") + MarchScenes::sun();
  const Vec2i size(60, 40);
  const PictureScene on(kOn, text, 0.003, size);
  // Nothing is said of levels where shadow rays have to read the finest in any case.
  const std::string sentence = choice(on, "rough");
  EXPECT_TRUE(sentence.empty() || sentence.find(" at level 0 ") != std::string::npos) << sentence;
  const std::vector<RayResult> with = on.picture(64),
                               expected = PictureScene(kExact, text, 1e-5, size).picture(64);
  for (size_t i = 0; i < with.size(); ++i)
    ASSERT_LE(difference(with[i].radiance, expected[i].radiance), 0.003) << i;
}

TEST_F(LevelOfDetail, each_grid_has_its_own_level) {
  const std::string text =
      blob_from(14.0) + rough("extinction = 2\nrotate_deg = [10, 20, 30]\nemission = [0.2, 0, 0.1]");
  const double tolerance = 0.04;
  const Vec2i size(60, 40);
  const PictureScene on(kOn, text, tolerance, size);
  EXPECT_EQ(choice(on).find(" at level 0 "), std::string::npos) << choice(on);
  EXPECT_NE(choice(on, "rough"), "");
  const std::vector<RayResult> with = on.picture(64),
                               expected = PictureScene(kExact, text, 1e-4, size).picture(64);
  for (size_t i = 0; i < with.size(); ++i)
    ASSERT_LE(difference(with[i].radiance, expected[i].radiance), tolerance) << i;
}

TEST_F(LevelOfDetail, shadow_rays_read_the_grid_as_it_is) {
  const PictureScene on("{ type = \"march\", sun_cache = false, level_of_detail = true }", blob_from(14.0),
                        0.03, {60, 40});
  const std::vector<std::string> choices = on.tracer().choices();
  ASSERT_EQ(choices.size(), 3u);
  EXPECT_EQ(choices[2], "density at the finest level: shadow rays read it");
}

}  // namespace
}  // namespace pileus
