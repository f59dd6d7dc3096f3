#include "vdb_io/volumes/cloud.h"

#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/commands.h"
#include "lib/core/error.h"
#include "lib/scene/scene.h"
#include "vdb_io/vdb_writer.h"

namespace pileus {

namespace {

struct CloudArguments {
  std::string recipe, output;
  VdbWriteOptions write;
  double voxel_size = 0.0;  ///< [m]; 0: as each cloud says
  bool quiet = false;
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

openvdb::FloatGrid::Ptr build(const Named<CloudVolume>& named, const Scene& scene,
                              const CloudArguments& arguments) {
  CloudVolume cloud = *named.object;
  if (arguments.voxel_size > 0) cloud.voxel_size = arguments.voxel_size;
  const auto show_progress = [&](double share) {
    if (!arguments.quiet) fmt::print(stderr, "\r{}: {:3.0f} %", named.name, 100 * share);
    return true;
  };
  const auto grid = cloud.build_grid(scene.freeforms, show_progress);
  if (!arguments.quiet) {
    fmt::print(stderr, "\r{}: {} active voxels of {} m\n", named.name, grid->activeVoxelCount(),
               cloud.voxel_size);
  }
  return grid;
}

void run(const CloudArguments& arguments) {
  const Scene scene = load_scene(arguments.recipe);
  const std::vector<Named<CloudVolume>> clouds = clouds_of(scene);
  std::vector<openvdb::FloatGrid::ConstPtr> grids;
  for (const Named<CloudVolume>& cloud : clouds) {
    const auto grid = build(cloud, scene, arguments);
    if (clouds.size() > 1)
      grid->setName(cloud.name);  // a single one stays "density", which programs look for
    grids.push_back(grid);
  }
  write_vdb(arguments.output, grids, arguments.write);
}

}  // namespace

void add_cloud_command(CLI::App& app, int&) {
  auto arguments = std::make_shared<CloudArguments>();
  CLI::App* command = app.add_subcommand("cloud", "build the procedural clouds of a scene into a .vdb file");
  command->add_option("recipe", arguments->recipe, "scene with volumes of type cloud (.toml)")->required();
  command->add_option("-o,--output", arguments->output, "file to write (.vdb)")->required();
  command->add_option("--voxel-size", arguments->voxel_size, "edge of a voxel [m], instead of the scene's")
      ->check(CLI::PositiveNumber);
  const std::map<std::string, VdbCodec> codecs{{"none", VdbCodec::none}, {"blosc", VdbCodec::blosc}};
  command->add_option("--codec", arguments->write.codec, "compression of the active voxels")
      ->transform(CLI::CheckedTransformer(codecs));
  command->add_flag("--half", arguments->write.half, "store 16-bit floats");
  command->add_flag("--quiet", arguments->quiet, "no progress");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace pileus
