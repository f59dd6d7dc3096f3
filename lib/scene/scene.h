#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "lib/freeform/free_form.h"
#include "lib/image/display.h"
#include "lib/math/vec.h"
#include "lib/scene/background.h"
#include "lib/scene/camera.h"
#include "lib/scene/fog_model.h"
#include "lib/scene/integrator.h"
#include "lib/scene/light.h"
#include "lib/scene/medium.h"
#include "lib/scene/shape.h"
#include "lib/scene/texture.h"

namespace pileus {

/// The `[render]` section: how large, how accurate, which planes.
struct RenderSettings {
  Vec2i size{960, 540};         ///< [pixels]
  double tolerance = 0.002;     ///< absolute error per channel of linear radiance
  int pixel_samples = 1;        ///< n: a regular grid of n x n rays per pixel
  int max_bounces = 8;          ///< how often a ray is followed on by mirrors and glass
  int seed = 0;                 ///< recorded; deterministic integrators draw no random numbers
  std::string aovs = "beauty";  ///< comma-separated planes to write
  std::shared_ptr<const Integrator> integrator;

  void describe(ParamTable& params);
};

/// An object of the scene with the name it was given: `[light.sun]` is a light named "sun".
template <class Kind>
struct Named {
  std::string name;
  std::shared_ptr<const Kind> object;
};

/// A scene as its file describes it: plain data, checked. Nothing is loaded or built yet.
struct Scene {
  std::string file;                          ///< as given by the user
  uint64_t hash = 0;                         ///< of the text after overrides: pictures record it
  std::vector<std::filesystem::path> files;  ///< what the scene reads besides: grids
  RenderSettings render;
  DisplayTransform display;
  std::shared_ptr<const Camera> camera;
  std::shared_ptr<const Background> background;
  std::vector<Named<Texture>> textures;
  std::vector<Named<Light>> lights;
  std::vector<Named<Medium>> volumes;
  std::vector<Named<Shape>> objects;
  std::vector<Named<FogModel>> fogs;
  FreeForms freeforms;
};

/// Reads a scene file. `overrides` are `path.to.key=value` strings that replace or add values first.
/// Throws Error(scene) with every problem of the file, each with line and column; Error(file) where it cannot
/// be read.
Scene load_scene(const std::filesystem::path& file, const std::vector<std::string>& overrides = {});

/// The same for text in memory; `name` stands in messages, relative paths start at `folder`.
Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& folder,
                  const std::vector<std::string>& overrides = {});

}  // namespace pileus
