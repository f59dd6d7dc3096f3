#include "vdb_io/openvdb/volume_writer.h"

#include <algorithm>

#include "lib/core/error.h"
#include "vdb_io/dense/dense_files.h"
#include "vdb_io/nvdb/nvdb_file.h"
#include "vdb_io/openvdb/dense_grid.h"
#include "vdb_io/openvdb/nvdb_grids.h"
#include "vdb_io/openvdb/vdb_writer.h"
#include "vdb_io/volume_format.h"

namespace pileus {
namespace {

std::string one_of(const std::filesystem::path& path, const std::string& codec,
                   const std::vector<std::string>& known) {
  if (std::count(known.begin(), known.end(), codec) > 0) return codec;
  throw Error(ErrorKind::usage, path.string(),
              fmt::format("codec \"{}\"; expected {} for this format", codec, join_or(known)));
}

std::vector<std::string> write_as_vdb(const std::filesystem::path& path,
                                      const std::vector<openvdb::GridBase::Ptr>& grids,
                                      const openvdb::MetaMap& metadata, const VolumeWriteOptions& options) {
  const std::string codec =
      one_of(path, options.codec.empty() ? "blosc" : options.codec, {"none", "zip", "blosc"});
  VdbWriteOptions write;
  write.half = options.half;
  write.codec = codec == "zip" ? VdbCodec::zip : codec == "none" ? VdbCodec::none : VdbCodec::blosc;
  const std::vector<openvdb::GridBase::ConstPtr> to_write(grids.begin(), grids.end());
  write_vdb_grids(path, to_write, metadata, write);
  std::vector<std::string> notes;
  const bool is_left_unpacked = std::any_of(grids.begin(), grids.end(), [](const auto& grid) {
    return grid->getGridClass() == openvdb::GRID_FOG_VOLUME ||
           grid->getGridClass() == openvdb::GRID_LEVEL_SET;
  });
  if (codec == "zip" && is_left_unpacked) {
    notes.push_back("OpenVDB zips neither fog volumes nor level sets: they are not packed; blosc packs them");
  }
  return notes;
}

std::vector<std::string> write_as_nvdb(const std::filesystem::path& path,
                                       const std::vector<openvdb::GridBase::Ptr>& grids,
                                       const openvdb::MetaMap& metadata, const VolumeWriteOptions& options) {
  const std::string codec =
      one_of(path, options.codec.empty() ? "none" : options.codec, {"none", "zip", "blosc"});
  if (options.half) {
    throw Error(ErrorKind::usage, path.string(),
                "NanoVDB has no half floats (its Fp16 is a share of each leaf's range); expected full ones");
  }
  std::vector<NvdbBuffer> buffers;
  size_t entries = metadata.metaCount();
  for (const auto& grid : grids) {
    buffers.push_back(nvdb_from_grid(path, *grid));
    for (auto meta = grid->beginMeta(); meta != grid->endMeta(); ++meta) {
      const bool is_known = meta->first == openvdb::GridBase::META_GRID_NAME ||
                            meta->first == openvdb::GridBase::META_GRID_CLASS ||
                            meta->first.rfind("file_", 0) == 0 ||
                            meta->first == openvdb::GridBase::META_SAVE_HALF_FLOAT;
      entries += is_known ? 0 : 1;
    }
  }
  write_nvdb(path, buffers,
             codec == "zip"     ? NvdbCodec::zip
             : codec == "blosc" ? NvdbCodec::blosc
                                : NvdbCodec::none);
  if (entries == 0) return {};
  return {fmt::format("NanoVDB has no room for {} metadata entries, which are left out", entries)};
}

std::vector<std::string> write_as_dense(const std::filesystem::path& path, VolumeFormat format,
                                        const std::vector<openvdb::GridBase::Ptr>& grids,
                                        const VolumeWriteOptions& options) {
  if (!options.codec.empty()) one_of(path, options.codec, {"none"});
  if (grids.size() != 1) {
    throw Error(ErrorKind::usage, path.string(),
                fmt::format("holds one grid, {} are to be written; choose one with --grid", grids.size()));
  }
  if (format == VolumeFormat::df3 && options.half) {
    throw Error(ErrorKind::usage, path.string(),
                "a .df3 file holds whole numbers; expected --bits 8, 16 or 32");
  }
  if (format == VolumeFormat::df3 && grids.front()->getGridClass() == openvdb::GRID_LEVEL_SET) {
    throw Error(
        ErrorKind::file, path.string(),
        fmt::format("grid \"{}\" is a level set (distances); a .df3 file holds a density; make one with "
                    "--levelset-to-fog",
                    grids.front()->getName()));
  }
  const DenseVolume volume = dense_from_grid(path, *grids.front(), options.half);
  if (format == VolumeFormat::df3) {
    write_df3(path, volume, options.df3_bits.value_or(16));
  } else if (format == VolumeFormat::npy) {
    write_npy(path, volume);
  } else {
    write_raw(path, volume);
  }
  return {fmt::format("name, place and scale are in {}; keep both together",
                      header_path(path).filename().string())};
}

}  // namespace

std::vector<std::string> write_volume(const std::filesystem::path& path,
                                      const std::vector<openvdb::GridBase::Ptr>& grids,
                                      const openvdb::MetaMap& metadata, const VolumeWriteOptions& options) {
  const auto known = volume_format(path);
  if (!known) {
    throw Error(ErrorKind::usage, path.string(),
                fmt::format("extension \"{}\" is no volume's; expected {}", path.extension().string(),
                            volume_extensions()));
  }
  const VolumeFormat format = *known;
  if (options.df3_bits && format != VolumeFormat::df3) {
    throw Error(ErrorKind::usage, path.string(),
                "--bits is for .df3 files, which hold whole numbers; expected --half, or no such option");
  }
  if (format == VolumeFormat::vdb) return write_as_vdb(path, grids, metadata, options);
  if (format == VolumeFormat::nvdb) return write_as_nvdb(path, grids, metadata, options);
  return write_as_dense(path, format, grids, options);
}

}  // namespace pileus
