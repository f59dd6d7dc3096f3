// What must not change a picture: how a field is sampled, in which units its voxels are placed, where the
// scene lies.
#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/fixtures/random_grid.h"
#include "tests/fixtures/temp_folder.h"
#include "tests/fixtures/traced_scene.h"

namespace pileus {
namespace {

std::string scene_with(const std::filesystem::path& file, const std::string& placement,
                       const Vec3d& shift = Vec3d(0.0)) {
  return fmt::format(R"(
[volume.grid]
type = "vdb"
file = "{}"
extinction = 0.7
{}
[light.sun]
type = "sun"
direction = [0.3, 0.8, 0.5]
[light.lamp]
type = "point"
position = [{}, {}, {}]
intensity = [200, 100, 50]
[object.ball]
type = "sphere"
center = [{}, {}, {}]
)",
                     file.string(), placement, shift.x + 4, shift.y + 12, shift.z + 4, shift.x + 4,
                     shift.y + 9, shift.z + 3);
}

/// Compares rays through the grid's box; `shift` moves the rays of the second scene.
void expect_same(const TracedScene& a, const TracedScene& b, const Vec3d& shift = Vec3d(0.0)) {
  for (int n = 0; n < 40; ++n) {
    const Ray ray{{-14, 3, 5}, normalize(Vec3d(1, 0.04 * (n % 8) - 0.1, 0.06 * (n / 8) - 0.15))};
    const RayResult first = a.trace(ray), second = b.trace({ray.o + shift, ray.d});
    for (int channel = 0; channel < 3; ++channel) {
      EXPECT_NEAR(first.radiance[channel], second.radiance[channel], 1e-6 * first.radiance[channel]) << n;
    }
    EXPECT_NEAR(first.transmittance, second.transmittance, 1e-6 * first.transmittance);
  }
}

TEST(Invariance, resampling_a_field_by_two) {
  const TempFolder folder;
  const auto grid = random_grid(8, 21);
  write_grid(folder / "coarse.vdb", grid);
  write_grid(folder / "fine.vdb", refined(*grid));
  expect_same(TracedScene(scene_with(folder / "coarse.vdb", "")),
              TracedScene(scene_with(folder / "fine.vdb", "")));
}

TEST(Invariance, scaling_voxels_with_their_transform) {
  const TempFolder folder;
  const auto grid = random_grid(8, 22);
  write_grid(folder / "metres.vdb", grid);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.01));
  write_grid(folder / "centimetres.vdb", grid);
  expect_same(TracedScene(scene_with(folder / "metres.vdb", "")),
              TracedScene(scene_with(folder / "centimetres.vdb", "scale = [100, 100, 100]")));
}

TEST(Invariance, turning_the_grid_back_by_its_placement) {
  const TempFolder folder;
  const auto grid = random_grid(8, 23);
  write_grid(folder / "plain.vdb", grid);
  grid->transform().postRotate(-std::acos(0.0), openvdb::math::Y_AXIS);
  write_grid(folder / "turned.vdb", grid);
  const TracedScene plain(scene_with(folder / "plain.vdb", ""));
  const TracedScene plus(scene_with(folder / "turned.vdb", "rotate_deg = [0, 90, 0]"));
  const TracedScene minus(scene_with(folder / "turned.vdb", "rotate_deg = [0, -90, 0]"));
  const Ray probe{{-14, 3, 5}, normalize(Vec3d(1, 0, 0))};
  const bool plus_matches =
      std::abs(plus.trace(probe).transmittance - plain.trace(probe).transmittance) < 1e-9;
  expect_same(plain, plus_matches ? plus : minus);
}

TEST(Invariance, moving_the_scene_far_from_the_origin) {
  const TempFolder folder;
  write_grid(folder / "grid.vdb", random_grid(8, 24));
  const Vec3d shift(1.5e5, -1.5e5, 1.5e5);
  expect_same(TracedScene(scene_with(folder / "grid.vdb", "")),
              TracedScene(scene_with(folder / "grid.vdb", "translate = [1.5e5, -1.5e5, 1.5e5]", shift)),
              shift);
}

}  // namespace
}  // namespace pileus
