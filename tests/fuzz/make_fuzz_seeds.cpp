// make_fuzz_seeds FOLDER: files to start fuzzing from, in FOLDER/READER for each reader: made by the
// project's own writers, and real ones where the outside test data is there.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/fixtures/vdb_seeds.h"
#include "vdb_io/dense/dense_files.h"
#include "vdb_io/nvdb/nvdb_file.h"
#include "vdb_io/openvdb/nvdb_grids.h"
#include "vdb_io/openvdb/openvdb_library.h"

namespace pileus {
namespace {

DenseVolume small_box() {
  DenseVolume volume;
  volume.size = {4, 3, 2};
  volume.samples = std::vector<float>(24, 0.5f);
  return volume;
}

/// A few voxels in two leaves, with each codec.
void write_nvdb_seeds(const std::filesystem::path& folder) {
  initialize_openvdb();
  const auto grid = openvdb::FloatGrid::create();
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  for (int i = 0; i < 12; ++i) grid->tree().setValueOn(openvdb::Coord(i, 2, 3), 0.1f * float(i + 1));
  for (const auto& [name, codec] : {std::pair{"none.nvdb", NvdbCodec::none},
                                    {"zip.nvdb", NvdbCodec::zip},
                                    {"blosc.nvdb", NvdbCodec::blosc}}) {
    std::vector<NvdbBuffer> buffers;
    buffers.push_back(nvdb_from_grid(folder / name, *grid));
    write_nvdb(folder / name, buffers, codec);
  }
}

/// Files of the outside test data that are no longer than what the fuzzers try.
void copy_real_files(const std::filesystem::path& folder) {
  constexpr uintmax_t kLongest = 65536;
  if (!std::filesystem::is_directory(PILEUS_DATA_DIR)) return;
  for (const auto& file : std::filesystem::recursive_directory_iterator(PILEUS_DATA_DIR)) {
    const std::string extension = file.path().extension().string();
    const std::string reader = extension.empty() ? "" : extension.substr(1);
    if (!file.is_regular_file() || !std::filesystem::is_directory(folder / reader)) continue;
    if (reader.empty() || file.file_size() > kLongest) continue;
    std::filesystem::copy_file(file.path(), folder / reader / file.path().filename(),
                               std::filesystem::copy_options::overwrite_existing);
  }
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
  pileus::write_nvdb_seeds(folder / "nvdb");
  pileus::write_npy(folder / "npy" / "box.npy", pileus::small_box());
  for (const auto& scene :
       std::filesystem::recursive_directory_iterator(PILEUS_SOURCE_DIR "/samples/scenes")) {
    if (scene.path().extension() != ".toml") continue;
    std::filesystem::copy_file(scene.path(), folder / "scene" / scene.path().filename(),
                               std::filesystem::copy_options::overwrite_existing);
  }
  pileus::copy_real_files(folder);
} catch (const std::exception& problem) {
  std::fprintf(stderr, "make_fuzz_seeds: %s\n", problem.what());
  return 1;
}
