// make_fuzz_seeds FOLDER: files to start fuzzing from, in FOLDER/READER for each reader.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/fixtures/vdb_seeds.h"
#include "vdb_io/dense/dense_files.h"

namespace pileus {
namespace {

DenseVolume small_box() {
  DenseVolume volume;
  volume.size = {4, 3, 2};
  volume.samples = std::vector<float>(24, 0.5f);
  return volume;
}

}  // namespace
}  // namespace pileus

int main(int argc, char** argv) try {
  if (argc != 2) return std::fputs("usage: make_fuzz_seeds FOLDER\n", stderr), 2;
  const std::filesystem::path folder = argv[1];
  pileus::write_vdb_seeds(folder / "vdb");
  for (const char* reader : {"df3", "npy", "nvdb", "scene"})
    std::filesystem::create_directories(folder / reader);
  for (const int bits : {8, 16, 32}) {
    pileus::write_df3(folder / "df3" / (std::to_string(bits) + ".df3"), pileus::small_box(), bits);
  }
  pileus::write_npy(folder / "npy" / "box.npy", pileus::small_box());
  for (const auto& scene :
       std::filesystem::recursive_directory_iterator(PILEUS_SOURCE_DIR "/samples/scenes")) {
    if (scene.path().extension() != ".toml") continue;
    std::filesystem::copy_file(scene.path(), folder / "scene" / scene.path().filename(),
                               std::filesystem::copy_options::overwrite_existing);
  }
} catch (const std::exception& problem) {
  std::fprintf(stderr, "make_fuzz_seeds: %s\n", problem.what());
  return 1;
}
