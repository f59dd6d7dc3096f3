#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/math/box.h"
#include "lib/scene/animation.h"
#include "pileus/pileus.h"
#include "vdb_io/vdb_summary.h"
#include "vdb_io/volume_format.h"

namespace pileus {
namespace {

// How a bare volume is shown: seen from a little above, three quarters of the way round to the front, lit by
// a warm sun from the left, whose light is scattered again and again, and by a blue sky. Irradiances make the
// sunlit side of a thick cloud about 1. The extinction makes most lines of sight this deep: octaves of
// scattering let much light through, so that form shows only where a volume is dense.
constexpr double kTypicalTau = 16.0;
constexpr double kFovDeg = 35.0;
constexpr double kMargin = 1.08;  ///< free border around the volume

const Vec3d kTowardsCamera = normalize(Vec3d(0.45, 0.22, 1.0));

/// Camera distance from the centre of a box at which all its corners are in the picture.
double framing_distance(const Box3d& box, const Vec2i& size) {
  const double tan_x = std::tan(0.5 * kFovDeg * std::numbers::pi / 180.0);
  const double tan_y = tan_x * size.y / size.x;
  const Vec3d right = normalize(cross(Vec3d(0.0, 1.0, 0.0), kTowardsCamera)),
              up = cross(kTowardsCamera, right);
  double distance = 0.0;
  for (int n = 0; n < 8; ++n) {
    const Vec3d half = 0.5 * box.size();
    const Vec3d corner(n & 1 ? half.x : -half.x, n & 2 ? half.y : -half.y, n & 4 ? half.z : -half.z);
    const double needed =
        kMargin * std::max(std::abs(dot(corner, right)) / tan_x, std::abs(dot(corner, up)) / tan_y);
    distance = std::max(distance, needed + dot(corner, kTowardsCamera));
  }
  return distance;
}

double default_extinction(const GridSummary& summary) {
  if (summary.typical_column > 0.0) return kTypicalTau / summary.typical_column;
  const double thickness = 0.3 * length(summary.bounds.size());
  return summary.max_density > 0.0 ? kTypicalTau / (summary.max_density * thickness) : 1.0;
}

/// A TOML basic string.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

std::string scene_text(const std::filesystem::path& file, const GridSummary& summary, const Vec3d& center,
                       double distance) {
  const Vec3d eye = center + distance * kTowardsCamera;
  return fmt::format(R"(pileus = 1
[camera]
type = "perspective"
position = [{}, {}, {}]
look_at = [{}, {}, {}]
fov_deg = {}
[background]
type = "gradient"
zenith = [0.05, 0.13, 0.32]
horizon = [0.28, 0.38, 0.52]
ground = [0.16, 0.18, 0.22]
[light.sun]
type = "sun"
direction = [-0.9, 0.75, 0.75]
irradiance = [8.8, 8.1, 7.0]
[volume.volume]
type = "vdb"
file = {}
extinction = {}
phase = {{ type = "two_lobe", g_forward = 0.6, g_backward = -0.25, weight = 0.6 }}
multiple_scattering = {{ octaves = 8 }}
ambient = {{ top = [0.18, 0.26, 0.40], bottom = [0.07, 0.085, 0.11] }}
)",
                     eye.x, eye.y, eye.z, center.x, center.y, center.z, kFovDeg, quoted(file.string()),
                     default_extinction(summary));
}

/// The grid that an override asks for; the framing must look at the same one.
std::string grid_override(const std::vector<std::string>& overrides) {
  constexpr std::string_view kKey = "volume.volume.grid=";
  std::string grid;
  for (const std::string& assignment : overrides) {
    if (assignment.rfind(kKey, 0) != 0) continue;
    grid = assignment.substr(kKey.size());
    grid.erase(std::remove(grid.begin(), grid.end(), '"'), grid.end());
  }
  return grid;
}

Scene load_bare_volume(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  const GridSummary summary = summarize_density(file, grid_override(overrides));
  const auto seen_from = [&](const Vec3d& center, double distance) {
    Scene scene = parse_scene(scene_text(file, summary, center, distance),
                              "default scene of " + file.string(), "", overrides);
    scene.file = file.string();
    return scene;
  };
  // The framing depends on the picture's shape and on the volume's placement, which the overrides may set:
  // read them, then frame.
  const Scene unframed = seen_from(summary.bounds.center(), length(summary.bounds.size()));
  const Box3d bounds = box_around(unframed.volumes.front().object->world_from_object(), summary.bounds);
  return seen_from(bounds.center(), framing_distance(bounds, unframed.render.size));
}

}  // namespace

Scene load(const std::filesystem::path& input, const std::vector<std::string>& overrides, double frame) {
  const std::string extension = input.extension().string();
  if (extension == ".toml") return load_scene(input, overrides, frame);
  if (volume_format(input)) return load_bare_volume(input, overrides);
  throw Error(ErrorKind::usage, input.string(),
              fmt::format("extension \"{}\" is neither a scene (.toml) nor a volume ({})", extension,
                          volume_extensions()));
}

}  // namespace pileus
