#include "lib/image/image_limits.h"

#include <system_error>

#include "lib/core/error.h"

namespace pileus {
namespace {

constexpr int64_t kAlwaysAllowedBytes = int64_t(1) << 30;
constexpr int64_t kMaxCompressionRatio = 2000;
constexpr int64_t kMaxChannels = 1024;

}  // namespace

void check_image_size(const std::filesystem::path& file, int64_t width, int64_t height, int64_t channels) {
  const auto refuse = [&](const std::string& message) {
    throw Error(ErrorKind::file, file.string(), message);
  };
  if (width < 1 || height < 1 || width > kMaxImagePixels / height) {
    refuse(fmt::format("the header claims {} x {} pixels; expected 1 to {} pixels", width, height,
                       kMaxImagePixels));
  }
  if (channels < 1 || channels > kMaxChannels) {
    refuse(fmt::format("the header claims {} channels; expected 1 to {}", channels, kMaxChannels));
  }
  std::error_code error;
  const auto file_bytes = std::filesystem::file_size(file, error);
  if (error) refuse(fmt::format("cannot be read: {}", error.message()));
  const int64_t image_bytes = width * height * channels * int64_t(sizeof(float));
  if (image_bytes > kAlwaysAllowedBytes && uint64_t(image_bytes) / kMaxCompressionRatio > file_bytes) {
    refuse(fmt::format(
        "the header claims {} x {} pixels of {} channels, but the file holds {} bytes; expected a "
        "header that fits its file",
        width, height, channels, file_bytes));
  }
}

}  // namespace pileus
