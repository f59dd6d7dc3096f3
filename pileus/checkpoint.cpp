#include "pileus/checkpoint.h"

#include <algorithm>

#include "lib/core/error.h"
#include "lib/core/version.h"
#include "lib/image/exr_io.h"

namespace pileus {
namespace {

constexpr const char* kDoneChannel = "done";
constexpr const char* kErrorChannel = "checkpoint_error";
constexpr const char* kFingerprint = "checkpointOf";

}  // namespace

std::string fingerprint_of(const Scene& scene, const Crop& crop) {
  std::string text =
      fmt::format("{} {:016x} {},{},{},{}", kVersion, scene.hash, crop.x0, crop.y0, crop.x1, crop.y1);
  for (const std::filesystem::path& file : scene.files) {
    std::error_code unknown;  // a file that cannot be looked at counts as size -1; reading it will complain
    text += fmt::format(" {}:{}", std::filesystem::file_size(file, unknown),
                        std::filesystem::last_write_time(file, unknown).time_since_epoch().count());
  }
  return text;
}

void save_checkpoint(const std::filesystem::path& file, const std::string& fingerprint, const Film& film,
                     const TileGrid& tiles) {
  Image image = film.image();
  image.metadata[kFingerprint] = fingerprint;
  image.add(kErrorChannel).values = film.errors();
  Channel& done = image.add(kDoneChannel);
  for (size_t tile = 0; tile < tiles.count(); ++tile) {
    if (!tiles.is_done(tile)) continue;
    for (const Vec2i& pixel : tiles.pixels(tile)) {
      done.values[size_t(pixel.y) * size_t(image.width) + size_t(pixel.x)] = 1.0f;
    }
  }
  write_exr(file, image);
}

void load_checkpoint(const std::filesystem::path& file, const std::string& fingerprint, Film& film,
                     TileGrid& tiles) {
  std::error_code unknown;
  if (!std::filesystem::exists(file, unknown)) return;
  const Image saved = read_exr(file);
  const auto found = saved.metadata.find(kFingerprint);
  const auto* belongs_to = found == saved.metadata.end() ? nullptr : std::get_if<std::string>(&found->second);
  const Channel* done = saved.find(kDoneChannel);
  const Channel* errors = saved.find(kErrorChannel);
  Image& image = film.image();
  const bool fits = belongs_to && *belongs_to == fingerprint && done && errors &&
                    saved.width == image.width && saved.height == image.height &&
                    std::all_of(image.channels.begin(), image.channels.end(),
                                [&](const Channel& channel) { return saved.find(channel.name); });
  if (!fits) {
    throw Error(ErrorKind::usage, file.string(),
                "is a checkpoint of another scene or other settings; remove it to start afresh");
  }
  for (Channel& channel : image.channels) channel.values = saved.find(channel.name)->values;
  film.errors() = errors->values;
  for (size_t tile = 0; tile < tiles.count(); ++tile) {
    const Vec2i corner = tiles.pixels(tile).front();
    if (done->values[size_t(corner.y) * size_t(image.width) + size_t(corner.x)] == 1.0f) tiles.set_done(tile);
  }
}

}  // namespace pileus
