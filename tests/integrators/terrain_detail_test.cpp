// A terrain that pixels see coarsely, under the march: shadow rays start off what the camera saw.
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include "tests/fixtures/march_scenes.h"
#include "tests/fixtures/picture_scene.h"

namespace pileus {
namespace {

/// Flat but for bumps that are a small part of a pixel.
std::string bumps(const TempFolder& folder) {
  std::ofstream file(folder / "bumps.asc");
  file << "ncols 65\nnrows 65\nxllcorner 5000\nyllcorner 5000\ncellsize 1\n";
  std::mt19937 random(3);
  std::uniform_real_distribution<double> height(-0.1, 0.1);
  for (int k = 0; k < 65 * 65; ++k) file << height(random) << (k % 65 == 64 ? "\n" : " ");
  return "[object.land]\ntype = \"terrain\"\nfile = \"" + (folder / "bumps.asc").string() +
         "\"\nlevel_of_detail = 0.5\n";
}

double mean_radiance(const PictureScene& scene) {
  double sum = 0.0;
  const std::vector<RayResult> picture = scene.picture(16);
  for (const RayResult& result : picture) sum += result.radiance.y;
  return sum / double(picture.size());
}

/// The sun stands high: hardly anything is shaded, whoever looks.
TEST(TerrainDetail, shades_nothing_by_what_a_pixel_does_not_see) {
  initialize_openvdb();
  const TempFolder folder;
  const MarchScenes scenes;
  const std::string text = MarchScenes::camera("[0, 60, 1]", "[0, 0, 0]") + MarchScenes::sun() +
                           bumps(folder) + scenes.grid("blob", "extinction = 0.01\ntranslate = [0, 20, 0]");
  const PictureScene march("\"march\"", text, 1e-3), exact("\"exact\"", text, 1e-3);
  const double expected = mean_radiance(exact);
  EXPECT_GT(expected, 0.5);
  EXPECT_NEAR(mean_radiance(march), expected, 0.02 * expected);
}

}  // namespace
}  // namespace pileus
