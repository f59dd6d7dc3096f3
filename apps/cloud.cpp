#include "vdb_io/volumes/cloud.h"

#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/commands.h"
#include "apps/interrupt.h"
#include "apps/numbers.h"
#include "apps/progress_bar.h"
#include "lib/core/atomic_file.h"
#include "lib/core/error.h"
#include "lib/scene/scene.h"
#include "vdb_io/vdb_writer.h"

namespace pileus {
namespace {

struct CloudCommand {
  std::filesystem::path recipe, output;
  VdbWriteOptions write;
  double voxel_size = 0.0;  ///< [m]; 0: as each cloud says
  bool quiet = false;

  void run() const;

 private:
  openvdb::FloatGrid::Ptr build(const Named<CloudVolume>& named, const FreeForms& freeforms) const;
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

openvdb::FloatGrid::Ptr CloudCommand::build(const Named<CloudVolume>& named,
                                            const FreeForms& freeforms) const {
  CloudVolume cloud = *named.object;
  if (voxel_size > 0) cloud.voxel_size = voxel_size;
  ProgressBar bar("building " + named.name, quiet);
  return cloud.build_grid(freeforms, [&](double share) {
    bar.update(share);
    return !is_interrupted();
  });
}

void CloudCommand::run() const {
  if (output.extension() != ".vdb") {
    throw Error(ErrorKind::usage, output.string(), "is no name for a cloud; expected one that ends in .vdb");
  }
  const Scene scene = load_scene(recipe);
  const std::vector<Named<CloudVolume>> clouds = clouds_of(scene);

  const CancellableScope cancellable;
  const AtomicFile probe(output);  // refuse now what could not be written after a long build
  std::vector<openvdb::FloatGrid::ConstPtr> grids;
  for (const Named<CloudVolume>& cloud : clouds) {
    const openvdb::FloatGrid::Ptr grid = build(cloud, scene.freeforms);
    if (clouds.size() > 1) grid->setName(cloud.name);  // one alone stays "density", which programs look for
    grids.push_back(grid);
  }
  write_vdb(output, grids, write);
  if (quiet) return;
  for (const auto& grid : grids) {
    fmt::print("{}: {}, {} active voxels of {} m\n", output.string(), grid->getName(),
               grid->activeVoxelCount(), grid->voxelSize().x());
  }
}

}  // namespace

void add_cloud_command(CLI::App& app, int&) {
  auto command = std::make_shared<CloudCommand>();
  CLI::App* sub = app.add_subcommand("cloud", "build the procedural clouds of a scene into a .vdb file");
  sub->add_option("RECIPE", command->recipe, "scene with volumes of type cloud (.toml)")->required();
  sub->add_option("-o,--output", command->output, "file to write (.vdb)")->required()->type_name("OUT.vdb");
  sub->add_option("--voxel-size", command->voxel_size, "edge of a voxel [m], instead of the scene's")
      ->check(finite_positive());
  const std::map<std::string, VdbCodec> codecs{{"none", VdbCodec::none}, {"blosc", VdbCodec::blosc}};
  sub->add_option("--codec", command->write.codec, "compression: none or blosc")
      ->type_name("NAME")
      ->transform(CLI::CheckedTransformer(codecs));
  sub->add_flag("--half", command->write.half, "store densities as 16-bit floats");
  sub->add_flag("--quiet", command->quiet, "print nothing but errors");
  sub->footer(
      "Examples:\n"
      "  pileus cloud cumulus.toml -o cumulus.vdb\n"
      "  pileus cloud cumulus.toml -o small.vdb --voxel-size 0.1 --half");
  sub->callback([command] { command->run(); });
}

}  // namespace pileus
