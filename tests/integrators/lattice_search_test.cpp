// Which caches of sunlight are looked for, and which are not.
#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "pileus/pileus.h"

namespace pileus {
namespace {

/// A sun behind a dense cloud of narrow phase function is thousands of times as bright as the tolerance: no
/// lattice is fine enough, and none is probed in vain.
TEST(LatticeSearch, ends_soon_where_no_lattice_will_do) {
  const std::string scene = R"(pileus = 1
[render]
size = [16, 9]
tolerance = 0.002
[camera]
type = "perspective"
position = [0, 1.5, 9]
look_at = [0, 1.2, 0]
[light.sun]
type = "sun"
direction = [0, 0, -1]
irradiance = [30, 20, 10]
[volume.puff]
type = "cloud"
preset = "cumulus"
center = [0, 1.2, 0]
size = [5.6, 3.2, 4]
voxel_size = 0.15
extinction = 8
phase = { type = "hg", g = 0.95 }
multiple_scattering = { octaves = 4 }
powder = { strength = 0.7, extinction = 5 }
)";
  const Rendering rendering = render(parse_scene(scene, "test", ""), {});
  const auto tells = [](const std::string& choice) {
    return choice.find("shadow rays") != std::string::npos;
  };
  const auto& choices = rendering.report.choices;
  EXPECT_TRUE(std::any_of(choices.begin(), choices.end(), tells));
  EXPECT_LT(rendering.report.seconds.at("cpu"), 60.0);
}

}  // namespace
}  // namespace pileus
