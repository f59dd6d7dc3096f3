#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lib/core/error.h"
#include "lib/image/image.h"
#include "lib/image/image_io.h"
#include "lib/scene/effect_plan.h"
#include "lib/scene/scene.h"

/// The public interface: load, render, save.
///
///   const pileus::Scene scene = pileus::load("scene.toml");
///   const pileus::Rendering rendering = pileus::render(scene);
///   pileus::save(rendering, "picture.png");
///
/// Every function reports trouble by throwing pileus::Error (lib/core/error.h).
namespace pileus {

/// Reads a scene (`.toml`), or a bare volume (`.vdb`) as a scene with a camera that frames it, a sun, a fill
/// light, a sky and an extinction that suits its density. `overrides` are `path.to.key=value` strings;
/// keyframes are read at `frame`.
Scene load(const std::filesystem::path& input, const std::vector<std::string>& overrides = {},
           double frame = 0.0);

/// A rectangle of pixels, [x0, x1) x [y0, y1), from the upper left corner.
struct Crop {
  int x0, y0, x1, y1;
};

struct KeptVolumes;  // pileus/kept_volumes.h

struct RenderOptions {
  int threads = 0;                   ///< 0: all cores
  std::optional<Crop> crop;          ///< the picture then has the size of the crop
  double time_limit = 0.0;           ///< [s]; > 0: the most accurate picture that the time allows, or the
                                     ///< coarsest one, late, where it allows none
  std::filesystem::path checkpoint;  ///< where an interrupted render leaves its tiles, and a later one finds
                                     ///< them; remove it when the picture is saved
  /// Called with the share done, 0 .. 1, from one thread at a time: with 0 once the scene is built, then per
  /// tile.
  std::function<void(double)> progress;
  KeptVolumes* kept = nullptr;         ///< volumes of the frame before, where there is one
  std::function<bool()> is_cancelled;  ///< polled often once the scene is built, from many threads; true ends
                                       ///< in Error(cancelled)
};

/// Figures of a render, as `--report` writes them.
struct RenderReport {
  std::string scene, integrator;
  double tolerance = 0.0;   ///< as asked
  double coarseness = 1.0;  ///< > 1 where a time limit made the render coarser
  int threads = 0;
  std::map<std::string, double>
      seconds;  ///< wall time by stage ("load", "build", "render", "write"), "wall", "cpu"; of "render"
                ///< "trace": the rays alone, without what was prepared for them
  uint64_t peak_memory_bytes = 0;
  uint64_t pixels = 0, rays = 0;
  Counters counters;
  std::vector<Effect> effects;
  std::vector<std::string> choices;  ///< what the integrator chose for this scene, and why
  std::optional<double> max_error_estimate, mean_error_estimate;  ///< where the integrator gives one
  std::optional<double> max_error_bound, mean_error_bound;        ///< where it proves one for every pixel
  uint64_t nan_pixels = 0;
  std::vector<std::string> warnings;
};

/// A finished picture with its planes, the display transform of its scene, and the figures.
struct Rendering {
  Image image;
  DisplayTransform display;
  RenderReport report;
};

/// Renders a scene. Pixels depend on the scene alone: not on threads, tiles, or a resumed checkpoint.
Rendering render(const Scene& scene, const RenderOptions& options = {});

/// What the scene's integrator would choose for it, and why, in sentences. Loads and builds the scene to find
/// out.
std::vector<std::string> explain_choices(const Scene& scene);

/// Writes `.exr` (all planes) or `.png` (display picture), atomically.
void save(const Rendering& rendering, const std::filesystem::path& file, bool half = false);

/// The report as JSON text.
std::string to_json(const RenderReport& report);

}  // namespace pileus
