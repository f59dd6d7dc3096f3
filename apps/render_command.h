#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "apps/scene_options.h"
#include "pileus/pileus.h"

namespace pileus {

/// What `pileus render` was asked for, and the rendering of one picture. A sequence of frames is made of
/// copies of it, one per frame (apps/render_frames.h).
struct RenderCommand {
  using Clock = std::chrono::steady_clock;

  SceneOptions scene;
  std::vector<std::filesystem::path> outputs;
  std::string crop;
  std::filesystem::path report;  ///< "": none
  std::string frames;            ///< "": one picture, of frame `frame`
  double frame = 0.0;            ///< at which keyframes are read
  int threads = 0;               ///< 0: all cores
  double time_limit = 0.0;       ///< [s]; 0: none
  bool resume = false, quiet = false, half = false, json = false;

  void run();

  /// Names as they are by default, and Error(usage) for those that cannot be.
  void complete_outputs();

  /// Refuses, before any time is spent, what could not be written in the end.
  void check_outputs(const Scene& loaded) const;

  /// The part of the picture that is asked for.
  Crop crop_of(const Scene& loaded) const;

  /// Where an interrupted render leaves what it has.
  std::filesystem::path checkpoint() const;

  struct Work {
    Clock::time_point start;      ///< of the loading: the report counts from here
    double load_seconds = 0.0;    ///< that the scene took
    bool has_checkpoint = false;  ///< goes on with it where it is there, and leaves it where interrupted
    KeptVolumes* kept = nullptr;  ///< as in RenderOptions
    std::string comments;         ///< that the pictures carry; "": none
    std::function<void(double)> progress;  ///< as in RenderOptions
  };

  /// Renders a scene and writes its pictures.
  Rendering render_to_files(const Scene& loaded, const Work& work) const;

  /// Warnings, and a line for each picture.
  void tell(const Rendering& rendering) const;

 private:
  void run_still();
};

}  // namespace pileus
