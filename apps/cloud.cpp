#include "vdb_io/volumes/cloud.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/commands.h"
#include "apps/frame_names.h"
#include "apps/interrupt.h"
#include "apps/numbers.h"
#include "apps/progress_bar.h"
#include "apps/scene_options.h"
#include "lib/core/error.h"
#include "lib/core/named_errors.h"
#include "lib/core/parallel.h"
#include "lib/scene/animation.h"
#include "vdb_io/load_openvdb.h"
#include "vdb_io/volume_format.h"

namespace pileus {
namespace {

struct CloudCommand {
  std::filesystem::path recipe, output;
  SceneOptions scene_options;  ///< --set
  std::string codec = "blosc";
  bool half = false;
  double voxel_size = 0.0;  ///< [m]; 0: as each cloud says
  double max_voxels = 0.0;  ///< 0: as each cloud says
  std::string max_bytes;    ///< "": as each cloud says
  std::vector<std::string> grids{"density"};
  std::string frames;  ///< "": one file, of frame `frame`
  double frame = 0.0;
  int threads = 0;  ///< 0: all cores
  bool resume = false, quiet = false;

  void run() const;

 private:
  void check() const;
  void build_sequence() const;
  void build_file(const std::filesystem::path& file, double frame_number,
                  const std::string& progress_note) const;
  CloudFile file_of(const Scene& scene, const std::filesystem::path& file) const;
  CloudGridOptions options_of(const CloudVolume& volume) const;
  VdbWriteOptions write_options() const;
};

/// Shows how far each cloud is, and then what was found out about it.
class Watch final : public CloudFileWatch {
 public:
  Watch(std::string progress_note, bool quiet) : m_progress_note(std::move(progress_note)), m_quiet(quiet) {}

  void begin(const NamedCloud& cloud) override {
    m_start = std::chrono::steady_clock::now();
    m_bar.emplace("building " + cloud.name + m_progress_note, m_quiet);
  }

  bool go_on(double share) override {
    if (m_bar) m_bar->update(share);
    return !is_interrupted();
  }

  void end(const NamedCloud& cloud, const CloudBuildCounters& counters) override {
    m_bar.reset();
    if (m_quiet) return;
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - m_start;
    const auto percent = [&](int64_t count) { return 100 * double(count) / double(counters.voxels); };
    fmt::print(
        "{}: {} voxels in {:.2f} s: bounds found {:.1f} % empty and {:.1f} % full, {:.1f} % "
        "were evaluated; {:.1f} % of the empty ones never were\n",
        cloud.name, counters.voxels, seconds.count(), percent(counters.empty_by_bound),
        percent(counters.full_by_bound), percent(counters.evaluated),
        100 * counters.share_of_empty_by_bound());
  }

 private:
  std::string m_progress_note;
  bool m_quiet;
  std::chrono::steady_clock::time_point m_start;
  std::optional<ProgressBar> m_bar;
};

/// The scene's volumes of type `cloud`.
std::vector<Named<CloudVolume>> clouds_of(const Scene& scene) {
  std::vector<Named<CloudVolume>> clouds;
  for (const Named<Medium>& volume : scene.volumes) {
    if (auto cloud = std::dynamic_pointer_cast<const CloudVolume>(volume.object)) {
      clouds.push_back({volume.name, std::move(cloud)});
    }
  }
  if (clouds.empty()) {
    throw Error(
        ErrorKind::scene, scene.file,
        fmt::format("has {} volumes, none of them a cloud; expected a [volume.NAME] with type = \"cloud\"",
                    scene.volumes.size()));
  }
  return clouds;
}

/// The limits of the command line replace those of the scene; a voxel size goes before limits.
CloudGridOptions CloudCommand::options_of(const CloudVolume& volume) const {
  CloudGridOptions options = volume.grid_options();
  if (voxel_size > 0) options.voxel_size = voxel_size;
  if (max_voxels > 0) options.max_voxels = int64_t(max_voxels);
  if (!max_bytes.empty()) options.max_bytes = parse_bytes(max_bytes).value();  // check() has seen it
  const bool is_by_limits = voxel_size == 0 && (max_voxels > 0 || !max_bytes.empty());
  if (is_by_limits) options.voxel_size = 0;
  return options;
}

void CloudCommand::check() const {
  if (volume_format(recipe)) {
    throw Error(
        ErrorKind::usage, recipe.string(),
        "is a volume already; expected a scene (.toml) with the recipe of one. `pileus convert` changes "
        "volumes, `pileus render` shows them");
  }
  if (output.extension() != ".vdb") {
    throw Error(ErrorKind::usage, output.string(), "is no name for a cloud; expected one that ends in .vdb");
  }
  if (has_frame_number(output) == frames.empty()) {
    throw Error(ErrorKind::usage, output.string(),
                frames.empty()
                    ? "names a sequence of files; expected --frames FIRST-LAST, such as --frames 1-48"
                    : "has no place for the number of a frame; expected one such as cloud.%04d.vdb");
  }
  if (resume && frames.empty()) {
    throw Error(ErrorKind::usage, SourceLoc{}, "--resume goes on with a sequence; expected --frames with it");
  }
  if (!max_bytes.empty() && !parse_bytes(max_bytes)) {
    throw Error(
        ErrorKind::usage, SourceLoc{},
        fmt::format("--max-bytes {}; expected a size from 1 byte to 1000 TB, such as 500MB, 1.5GiB or 2e9",
                    max_bytes));
  }
  for (size_t i = 0; i < grids.size(); ++i) {
    if (std::count(grids.begin(), grids.end(), grids[i]) > 1) {
      throw Error(ErrorKind::usage, SourceLoc{}, fmt::format("--grids names \"{}\" twice", grids[i]));
    }
  }
}

VdbWriteOptions CloudCommand::write_options() const {
  VdbWriteOptions write;
  write.half = half;
  write.codec = codec == "zip" ? VdbCodec::zip : codec == "none" ? VdbCodec::none : VdbCodec::blosc;
  return write;
}

CloudFile CloudCommand::file_of(const Scene& scene, const std::filesystem::path& file) const {
  CloudFile cloud_file{file, {}, grids, write_options()};
  for (const Named<CloudVolume>& named : clouds_of(scene)) {
    const CloudVolume& volume = *named.object;
    cloud_file.clouds.push_back(
        {named.name, named_errors("volume", named.name, [&] { return volume.cloud(scene.freeforms); }),
         volume.fields, options_of(volume)});
  }
  return cloud_file;
}

void show(const std::filesystem::path& file, const WrittenGrid& grid) {
  fmt::print("{}: {}, {} active voxels of {:.6g} m\n", file.string(), grid.name, grid.active_voxels,
             grid.voxel_size);
  if (grid.active_voxels == 0) {
    std::fputs(fmt::format("pileus: warning: {}: {} is empty; a lower erosion or threshold, or a smaller "
                           "voxel_size, leaves more\n",
                           file.string(), grid.name)
                   .c_str(),
               stderr);
  }
}

void CloudCommand::build_file(const std::filesystem::path& file, double frame_number,
                              const std::string& progress_note) const {
  const Scene scene = load_scene(recipe, scene_options.settings, frame_number);
  Watch watch(progress_note, quiet);
  const std::vector<WrittenGrid> written = load_openvdb().write_cloud_file(file_of(scene, file), watch);
  if (quiet) return;
  for (const WrittenGrid& grid : written) show(file, grid);
}

void CloudCommand::run() const {
  check();
  const CancellableScope cancellable;
  with_threads(threads, [this] { frames.empty() ? build_file(output, frame, "") : build_sequence(); });
}

void CloudCommand::build_sequence() const {
  const std::vector<int> numbers = parse_frames(frames);
  for (size_t i = 0; i < numbers.size(); ++i) {
    const std::filesystem::path file = frame_name(output, numbers[i]);
    if (resume && std::filesystem::exists(file)) continue;  // whole: no file is ever half written
    build_file(file, numbers[i], fmt::format(", frame {} ({} of {})", numbers[i], i + 1, numbers.size()));
    if (is_interrupted()) throw Error(ErrorKind::cancelled, SourceLoc{}, "the sequence was cancelled");
  }
}

}  // namespace

void add_cloud_command(CLI::App& app, int&) {
  auto command = std::make_shared<CloudCommand>();
  CLI::App* sub = app.add_subcommand("cloud", "build the procedural clouds of a scene into a .vdb file");
  sub->add_option("RECIPE", command->recipe, "scene with volumes of type cloud (.toml)")->required();
  sub->add_option("-o,--output", command->output,
                  "file to write (.vdb); with %04d where --frames puts numbers")
      ->required()
      ->type_name("OUT.vdb");
  sub->add_option("--voxel-size", command->voxel_size, "edge of a voxel [m], instead of the scene's")
      ->check(finite_positive());
  sub->add_option("--max-voxels", command->max_voxels,
                  "as small voxels as leave no more than this in the cloud's bounding box; a limit beside "
                  "--voxel-size")
      ->check(finite_positive())
      ->check(CLI::Range(1.0, 1e12));
  sub->add_option(
         "--max-bytes", command->max_bytes,
         "as small voxels as make no larger density grid in memory; 500MB, 2GB, 1e9, ...; a limit beside "
         "--voxel-size")
      ->type_name("BYTES");
  std::vector<std::string> names = cloud_field_names();
  names.insert(names.begin(), "density");
  sub->add_option("--grids", command->grids,
                  "grids to write: density, temperature, Cd, vel (comma-separated)")
      ->delimiter(',')
      ->type_name("LIST")
      ->check(CLI::IsMember(names));
  CLI::Option* const frames =
      sub->add_option("--frames", command->frames, "a file for each frame: 1-48, or 1-48x4 for every fourth");
  sub->add_option("--frame", command->frame, "the frame at which keyframes are read (default 0)")
      ->check(finite())
      ->excludes(frames);
  sub->add_flag("--resume", command->resume, "leave the frames alone whose files are there");
  sub->add_option("--codec", command->codec, "compression: none, blosc or zip")
      ->type_name("NAME")
      ->check(CLI::IsMember({"none", "blosc", "zip"}))
      ->capture_default_str();
  sub->add_flag("--half", command->half, "store values as 16-bit floats");
  sub->add_option("--threads", command->threads, "0: one for each core (default)")
      ->check(CLI::NonNegativeNumber);
  command->scene_options.add_settings_to(*sub);
  sub->add_flag("--quiet", command->quiet, "print nothing but errors");
  sub->footer(
      "Examples:\n"
      "  pileus cloud cumulus.toml -o cumulus.vdb\n"
      "  pileus cloud cumulus.toml -o small.vdb --max-bytes 50MB --half\n"
      "  pileus cloud plume.toml -o plume.vdb --grids density,temperature,vel\n"
      "  pileus cloud morph.toml -o morph.%04d.vdb --frames 1-48 --resume");
  sub->callback([command] { command->run(); });
}

}  // namespace pileus
