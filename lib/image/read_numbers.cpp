#include "lib/image/read_numbers.h"

#include <utility>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "lib/image/exr_io.h"
#include "lib/image/grey_png.h"
#include "lib/image/image_limits.h"
#include "lib/image/load_pictures.h"

namespace pileus {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& message) {
  throw Error(ErrorKind::file, file.string(), message);
}

NumberPlane from_exr(const std::filesystem::path& file) {
  Image image = read_exr(file);
  const Channel* found = image.channels.size() == 1 ? &image.channels.front() : image.find("Y");
  if (!found) {
    refuse(file, fmt::format("has {} channels and none named Y; expected one", image.channels.size()));
  }
  return {image.width, image.height, {found->values.begin(), found->values.end()}};
}

}  // namespace

void check_plane_size(const std::filesystem::path& file, int64_t width, int64_t height, uint64_t channels) {
  check_image_size(file, width, height, int64_t(channels));
  if (uint64_t(width) * uint64_t(height) * channels * 3 * sizeof(float) > memory_budget()) {
    refuse(file, fmt::format("claims {} x {} pixels, more than {} can hold", width, height,
                             bytes_text(memory_budget())));
  }
}

NumberPlane read_number_plane(const std::filesystem::path& file) {
  if (file.extension() == ".exr") return from_exr(file);
  if (file.extension() == ".png") {
    if (auto plane = read_grey_png(file)) return std::move(*plane);
  }
  std::string reason;
  const auto reader = load_pictures().open(file.string(), reason);
  if (!reader) refuse(file, fmt::format("cannot be read as a picture: {}", reason));
  const PictureHeader& header = reader->header();
  const size_t channels = header.channels.size();
  if (header.depth > 1 || channels == 0 || channels > 2 || (channels == 2 && header.alpha_channel != 1)) {
    refuse(file, fmt::format("has {} channels; expected one of grey values", channels));
  }
  check_plane_size(file, header.width, header.height, channels);
  const uint64_t count = uint64_t(header.width) * uint64_t(header.height);
  NumberPlane plane{header.width, header.height, {}};
  plane.values.resize(count * channels);
  if (!reader->read_numbers(plane.values.data(), reason)) {
    refuse(file, fmt::format("is damaged: {}", reason.substr(0, reason.find('\n'))));
  }
  for (size_t i = 0; channels > 1 && i < count; ++i) plane.values[i] = plane.values[i * channels];
  plane.values.resize(count);
  return plane;
}

}  // namespace pileus
